#include "camvox/tracking_component/rotation_history.hpp"

namespace camvox::tracking_component {

void RotationHistory::add(std::uint64_t frame_id, const geometry::SO3& R_previous_camera) {
  rotations_[frame_id] = R_previous_camera;
  if (rotations_.size() > kCapacity) rotations_.erase(rotations_.begin());
}

std::optional<geometry::SO3> RotationHistory::between(std::uint64_t from, std::uint64_t to) const {
  if (from == 0 || to <= from || to - from > kCapacity) return std::nullopt;
  geometry::SO3 R_from_to;
  for (std::uint64_t id = from + 1; id <= to; ++id) {
    const auto found = rotations_.find(id);
    if (found == rotations_.end()) return std::nullopt;
    R_from_to = R_from_to * found->second;
  }
  return R_from_to;
}

}  // namespace camvox::tracking_component
