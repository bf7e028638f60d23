#pragma once

#include <Eigen/Core>
#include <vector>

#include "camvox/calibration/lidar_edges.hpp"

namespace camvox::calibration {

/// Outlines of near things in a cloud whose points are stored along its scan lines, as drivers of
/// spinning lidars do: between two neighbours of a line, the nearer one on a surface, the other
/// behind it. The place along the line is known to half a step, far better than from a window over
/// several lines. Kept are those that go on as a straight piece in other lines: not leaves. In a
/// cloud of another order next to none are found. `points_lidar` in m, a view of up to 180 degrees.
///
/// Idea of range discontinuities in scan lines: Levinson & Thrun, "Automatic online calibration of
/// cameras and lasers", RSS 2013.
[[nodiscard]] std::vector<LidarEdge> find_outlines(const std::vector<Eigen::Vector3d>& points_lidar,
                                                   double min_depth_ratio);

}  // namespace camvox::calibration
