#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::tracking {

/// A point of the map, and where the camera sees what may be the same point, with depth.
struct PointPair {
  Eigen::Vector3d p_map;
  Eigen::Vector3d p_camera;
};

struct DepthAlignmentOptions {
  int iterations = 300;
  std::uint64_t seed = 1;
  double tolerance_m = 0.05;      ///< Pairs fit when they are nearer than this ...
  double tolerance_ratio = 0.02;  ///< ... plus this share of the distance.
  int min_inliers = 15;
};

struct DepthAlignment {
  geometry::SE3 T_map_camera;
  std::vector<bool> inliers;  ///< One for each pair.
  int inlier_count = 0;
};

/// The camera pose that lays most pairs onto each other: RANSAC over triples (Fischler & Bolles,
/// 1981) with the closed-form pose of Kabsch/Umeyama, refined on its inliers. Needs no start.
/// Nothing when fewer than min_inliers agree. The same seed gives the same answer.
[[nodiscard]] std::optional<DepthAlignment> align_by_depth(std::span<const PointPair> pairs,
                                                           const DepthAlignmentOptions& options);

}  // namespace camvox::tracking
