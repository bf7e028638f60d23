#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::depth {

/// Returns as the camera sees them; entry i of every list is one return.
struct ProjectedPoints {
  std::vector<float> u_px;
  std::vector<float> v_px;
  std::vector<float> rho;         ///< 1 / z, in 1/m.
  std::vector<float> shift_u_px;  ///< Pixel in the camera's view minus that in a camera with the
  std::vector<float> shift_v_px;  ///< same axes at the lidar: how much the change of view moves it.

  [[nodiscard]] std::size_t size() const { return u_px.size(); }
  [[nodiscard]] std::array<std::vector<float>*, 5> lists() {
    return {&u_px, &v_px, &rho, &shift_u_px, &shift_v_px};
  }
  void resize(std::size_t count);
};

/// Limits of what is kept.
struct ProjectionBounds {
  float min_range_m = 0.5F;
  float max_range_m = 130.0F;
  float margin_px = 16.0F;  ///< Around the image: returns beside it support the planes in it.
};

/// CameraModel::project for many points: single precision, the radial part of the lens model from a
/// table. Agrees with it to 0.01 px. What is more than 85 degrees off the axis is left out.
class PointProjection {
 public:
  PointProjection(const sensors::CameraModel& camera, const ProjectionBounds& bounds);

  /// Appends the returns (rows of four: x y z in the lidar frame and a number to ignore) that are
  /// in bounds, in order.
  void append(std::span<const float> points_lidar,
              const geometry::SE3& T_camera_lidar,
              ProjectedPoints& points) const;

 private:
  struct Block;
  struct Lens;
  void project_block(const float* points, std::size_t count, const float* T, Block& block) const;

  /// Value and step to the next entry of the radial factor, over equal steps of the squared radius.
  struct Entry {
    float value;
    float step;
  };
  std::vector<Entry> radial_;
  float entries_per_radius2_ = 0.0F;
  float max_radius2_ = 0.0F;
  float p1_ = 0.0F, p2_ = 0.0F;
  float fx_, fy_, cx_, cy_;
  float u_min_, u_max_, v_min_, v_max_;
  float min_range2_, max_range2_;
};

}  // namespace camvox::depth
