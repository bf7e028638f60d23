#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "camvox/features/feature.hpp"

namespace camvox::features {

/// A square around a pixel of the undistorted image, and the octaves to look at.
struct SearchArea {
  Eigen::Vector2f u_px = Eigen::Vector2f::Zero();
  float radius_px = 0.0F;  ///< Half the side; the edge is inside.
  int min_octave = 0;
  int max_octave = 255;
};

/// Finds the features of a frame in an area by 64x48 cells over the undistorted image.
class FeatureGrid {
 public:
  FeatureGrid() = default;
  /// Takes undistorted_px of the features, or the raw pixels when that list is empty. At most
  /// 65536.
  explicit FeatureGrid(const FrameFeatures& features);

  /// Replaces `found` by the features in the area, in a fixed order (cell by cell, then as in the
  /// frame).
  void find(const SearchArea& area, std::vector<std::uint32_t>& found) const;
  [[nodiscard]] std::vector<std::uint32_t> find(const SearchArea& area) const;

 private:
  static constexpr int kColumns = 64;
  static constexpr int kRows = 48;
  struct Entry {
    float u_px;
    float v_px;
    std::uint16_t index;
    std::uint16_t octave;
  };

  [[nodiscard]] int column(float u_px) const;
  [[nodiscard]] int row(float v_px) const;

  Eigen::Vector2f origin_px_ = Eigen::Vector2f::Zero();
  Eigen::Vector2f cells_per_px_ = Eigen::Vector2f::Zero();
  std::vector<Entry> entries_;         ///< Sorted by cell: a row of cells is one range.
  std::vector<std::uint32_t> starts_;  ///< First entry of each cell, and the end.
};

}  // namespace camvox::features
