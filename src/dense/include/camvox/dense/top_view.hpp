#pragma once

#include <vector>

#include "camvox/dense/dense_map.hpp"

namespace camvox::dense {

/// An RGB picture without gaps.
struct Picture {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgb;
  double m_per_px = 0.0;
};

/// The map from above (along -z; x to the right, y up the page): the highest point of each pixel,
/// black where there is none, `path` in red on top. The picture shows all but the outermost 1 % of
/// the points, and is at most `max_size_px` wide and high. Empty without points.
[[nodiscard]] Picture draw_top_view(const std::vector<ColouredPoint>& points_map,
                                    const std::vector<Eigen::Vector3d>& path,
                                    int max_size_px = 1200);

}  // namespace camvox::dense
