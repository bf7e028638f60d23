#pragma once

#include <map>
#include <vector>

#include "camvox/tracking/local_map.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::test {

/// The map without mapping: landmarks stay as they were founded, and the local map is what the
/// latest keyframes founded. To see what tracking does by itself.
class FoundedMap {
 public:
  explicit FoundedMap(const tracking::TrackingCamera& camera) : camera_(camera) {}

  /// Like mapping, does nothing for an id that is there already.
  void insert(const tracking::Keyframe& keyframe) {
    if (poses_.contains(keyframe.id)) return;
    poses_[keyframe.id] = keyframe.T_map_camera;
    auto& own = landmarks_[keyframe.id];
    for (std::size_t i = 0; i < keyframe.landmark_ids.size(); ++i) {
      if (keyframe.landmark_ids[i] != tracking::landmark_id(keyframe.id, i)) continue;
      own.push_back(*tracking::landmark_from_depth(keyframe, i, camera_.pinhole, camera_.scale));
    }
  }

  [[nodiscard]] tracking::LocalMap local_map(std::uint64_t frame_id) const {
    constexpr tracking::KeyframeId kLatest = 20;
    tracking::LocalMap map;
    map.frame_id = frame_id;
    if (poses_.empty()) return map;
    map.reference_keyframe_id = poses_.rbegin()->first;
    map.next_keyframe_id = map.reference_keyframe_id + 1;
    for (const auto& [id, T_map_camera] : poses_) {
      if (id + kLatest <= map.reference_keyframe_id) continue;
      map.keyframes.push_back({id, T_map_camera});
      const auto& own = landmarks_.at(id);
      map.landmarks.insert(map.landmarks.end(), own.begin(), own.end());
    }
    return map;
  }

  [[nodiscard]] const std::map<tracking::KeyframeId, geometry::SE3>& poses() const {
    return poses_;
  }

 private:
  tracking::TrackingCamera camera_;
  std::map<tracking::KeyframeId, geometry::SE3> poses_;
  std::map<tracking::KeyframeId, std::vector<tracking::Landmark>> landmarks_;
};

}  // namespace camvox::test
