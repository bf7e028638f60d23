#pragma once

#include <cstdint>
#include <vector>

#include "camvox/geometry/se3.hpp"

/// Trajectories as files, and how far one is from another.
namespace camvox::trajectory {

/// Where something was at a time. "body" is whatever moves: a robot, a camera.
struct StampedPose {
  std::int64_t stamp_ns = 0;
  geometry::SE3 T_world_body;
};

/// Poses in order of time.
using Trajectory = std::vector<StampedPose>;

/// Length of the path through all positions.
[[nodiscard]] double path_length_m(const Trajectory& trajectory);

/// A reference pose and the estimate of the same moment.
struct PosePair {
  StampedPose reference;
  StampedPose estimate;
};

/// For each estimated pose the reference pose nearest in time, if it is within `max_difference_ns`;
/// `offset_ns` is added to the estimate's stamps. No reference pose is used twice: the nearer
/// estimate gets it.
[[nodiscard]] std::vector<PosePair> associate(const Trajectory& reference,
                                              const Trajectory& estimate,
                                              std::int64_t max_difference_ns = 10'000'000,
                                              std::int64_t offset_ns = 0);

}  // namespace camvox::trajectory
