#include "camvox/trajectory/keyframe_path.hpp"

#include <algorithm>
#include <iterator>

namespace camvox::trajectory {

void KeyframePath::add_frame(const AnchoredPose& pose) {
  if (!poses_.empty() && pose.stamp_ns <= poses_.back().stamp_ns) return;
  poses_.push_back(pose);
}

void KeyframePath::add_keyframe(std::uint64_t id,
                                std::int64_t stamp_ns,
                                const geometry::SE3& T_map_camera) {
  keyframes_.try_emplace(id, Keyframe{stamp_ns, T_map_camera});
}

void KeyframePath::move_keyframe(std::uint64_t id, const geometry::SE3& T_map_camera) {
  const auto found = keyframes_.find(id);
  if (found != keyframes_.end()) found->second.T_map_camera = T_map_camera;
}

void KeyframePath::remove_keyframe(std::uint64_t id) {
  const auto removed = keyframes_.find(id);
  if (removed == keyframes_.end() || keyframes_.size() == 1) return;
  const auto anchor = removed == keyframes_.begin() ? std::next(removed) : std::prev(removed);
  const geometry::SE3 T_anchor_removed =
      anchor->second.T_map_camera.inverse() * removed->second.T_map_camera;
  for (auto& pose : poses_) {
    if (pose.keyframe_id != id) continue;
    pose.keyframe_id = anchor->first;
    pose.T_keyframe_camera = T_anchor_removed * pose.T_keyframe_camera;
  }
  keyframes_.erase(removed);
}

Trajectory KeyframePath::frames() const {
  Trajectory trajectory;
  trajectory.reserve(poses_.size());
  for (const auto& pose : poses_) {
    const auto keyframe = keyframes_.find(pose.keyframe_id);
    if (keyframe != keyframes_.end()) {
      trajectory.push_back({pose.stamp_ns, keyframe->second.T_map_camera * pose.T_keyframe_camera});
    } else if (pose.T_map_camera) {
      trajectory.push_back({pose.stamp_ns, *pose.T_map_camera});
    }
  }
  return trajectory;
}

Trajectory KeyframePath::keyframes() const {
  Trajectory trajectory;
  trajectory.reserve(keyframes_.size());
  for (const auto& entry : keyframes_) {
    trajectory.push_back({entry.second.stamp_ns, entry.second.T_map_camera});
  }
  std::sort(trajectory.begin(), trajectory.end(), [](const auto& a, const auto& b) {
    return a.stamp_ns < b.stamp_ns;
  });
  return trajectory;
}

}  // namespace camvox::trajectory
