#include "camvox/trajectory/trajectory.hpp"

#include <algorithm>
#include <cstdlib>

namespace camvox::trajectory {
namespace {

/// The reference pose nearest to a time; `reference` is not empty.
std::size_t nearest(const Trajectory& reference, std::int64_t stamp_ns) {
  const auto after = std::lower_bound(
      reference.begin(),
      reference.end(),
      stamp_ns,
      [](const StampedPose& pose, std::int64_t stamp) { return pose.stamp_ns < stamp; });
  const auto index = static_cast<std::size_t>(after - reference.begin());
  if (index == 0) return 0;
  if (index == reference.size()) return index - 1;
  const auto to_before = stamp_ns - reference[index - 1].stamp_ns;
  const auto to_after = reference[index].stamp_ns - stamp_ns;
  return to_after < to_before ? index : index - 1;
}

}  // namespace

double path_length_m(const Trajectory& trajectory) {
  double length_m = 0.0;
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    length_m +=
        (trajectory[i].T_world_body.translation() - trajectory[i - 1].T_world_body.translation())
            .norm();
  }
  return length_m;
}

std::vector<PosePair> associate(const Trajectory& reference,
                                const Trajectory& estimate,
                                std::int64_t max_difference_ns,
                                std::int64_t offset_ns) {
  std::vector<PosePair> pairs;
  if (reference.empty()) return pairs;
  const auto difference = [](const PosePair& pair) {
    return std::abs(pair.reference.stamp_ns - pair.estimate.stamp_ns);
  };
  for (const auto& pose : estimate) {
    PosePair pair{{}, {pose.stamp_ns + offset_ns, pose.T_world_body}};
    pair.reference = reference[nearest(reference, pair.estimate.stamp_ns)];
    if (difference(pair) > max_difference_ns) continue;
    if (!pairs.empty() && pairs.back().reference.stamp_ns == pair.reference.stamp_ns) {
      if (difference(pair) < difference(pairs.back())) pairs.back() = pair;
      continue;
    }
    pairs.push_back(pair);
  }
  return pairs;
}

}  // namespace camvox::trajectory
