#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::loop {

/// The same point in two frames.
struct PointPair {
  Eigen::Vector3d p_place = Eigen::Vector3d::Zero();
  Eigen::Vector3d p_query = Eigen::Vector3d::Zero();
  double tolerance_m = 0.0;  ///< How far off the two distances to another point may be.
};

/// The rigid motion with the smallest sum of squared distances |p_place - T_place_query p_query|^2
/// (Horn, 1987, by singular value decomposition); nothing for fewer than three points, or when
/// they lie on one line.
[[nodiscard]] std::optional<geometry::SE3> align_points(const std::vector<PointPair>& pairs);

struct RigidRansacRule {
  int max_iterations = 400;
  std::uint64_t seed = 1;
  std::size_t candidates = 0;  ///< Number of matches that `count_inliers` judges.
};

/// The motion of three pairs with the most inliers, as `count_inliers` counts them; nothing when no
/// sample is rigid. Stops early when a better one is improbable (1e-3).
[[nodiscard]] std::optional<geometry::SE3> rigid_ransac(
    const std::vector<PointPair>& pairs,
    const RigidRansacRule& rule,
    const std::function<int(const geometry::SE3&)>& count_inliers);

}  // namespace camvox::loop
