#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::features {

/// Moves pixels to where a pinhole camera with the same fx fy cx cy, without distortion, would see
/// them. Interpolates a table of the lens model's inverse (every 16 px, bicubic); where that is not
/// accurate to 0.01 px the model itself is inverted. Immutable after construction.
class Undistorter {
 public:
  explicit Undistorter(const sensors::CameraModel& camera);

  /// Nothing for a pixel outside the image, or that the lens model says nothing can be seen at.
  [[nodiscard]] std::optional<Eigen::Vector2f> undistort(const Eigen::Vector2f& u_px) const;

  /// Fills undistorted_px; features without such a place are removed from all lists.
  void undistort(FrameFeatures& features) const;

  /// Share of the table's cells that are accurate enough to be used.
  [[nodiscard]] double table_share() const;

 private:
  static constexpr int kSpacing_px = 16;

  [[nodiscard]] Eigen::Vector2f interpolate(const Eigen::Vector2f& u_px) const;
  [[nodiscard]] std::optional<Eigen::Vector2d> invert(const Eigen::Vector2d& u_px) const;
  void fill_table();
  void check_cells();

  sensors::CameraModel camera_;
  bool pinhole_;  ///< No distortion: pixels stay where they are.
  int columns_ = 0;
  int rows_ = 0;
  std::vector<Eigen::Vector2f> shift_px_;  ///< At the corners of the cells, one more ring around.
  std::vector<std::uint8_t> node_valid_;
  std::vector<std::uint8_t> cell_accurate_;
};

}  // namespace camvox::features
