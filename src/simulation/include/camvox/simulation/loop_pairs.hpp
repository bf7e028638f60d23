#pragma once

#include <cstdint>
#include <vector>

#include "camvox/simulation/trajectory.hpp"

namespace camvox::simulation {

/// Two images of the same place at different visits.
struct LoopPair {
  std::int64_t earlier_frame;
  std::int64_t later_frame;
  double distance_m;
  double heading_difference_rad;  ///< 0 same direction, pi opposite.
};

/// When two images count as a loop.
struct LoopPairRule {
  double max_distance_m = 3.0;
  double min_travel_m = 25.0;  ///< Path driven in between.
};

/// For every image (at `rate_hz`, the first at time 0) the nearest earlier one that satisfies the
/// rule, if there is one.
[[nodiscard]] std::vector<LoopPair> loop_pairs(const Trajectory& trajectory,
                                               double rate_hz,
                                               const LoopPairRule& rule = {});

}  // namespace camvox::simulation
