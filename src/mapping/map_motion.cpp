#include <deque>
#include <optional>

#include "camvox/mapping/keyframes.hpp"

namespace camvox::mapping {
namespace {

using geometry::SE3;

/// How far each keyframe moves, as a transform of the map frame; those that stay are left out.
std::map<KeyframeId, SE3> motions(const Map& map,
                                  const KeyframePoses& new_poses,
                                  const std::function<bool(KeyframeId)>& follows) {
  std::map<KeyframeId, SE3> T_new_old;
  if (map.keyframes().empty()) return T_new_old;
  std::deque<KeyframeId> open = {map.keyframes().begin()->first};
  while (!open.empty()) {
    const KeyframeId id = open.front();
    open.pop_front();
    const auto& keyframe = map.keyframe(id);
    open.insert(open.end(), keyframe.children.begin(), keyframe.children.end());
    if (const auto given = new_poses.find(id); given != new_poses.end()) {
      T_new_old[id] = given->second * keyframe.frame.T_map_camera.inverse();
    } else if (follows(id)) {
      const auto parent = T_new_old.find(keyframe.parent);
      if (parent != T_new_old.end()) T_new_old[id] = parent->second;
    }
  }
  return T_new_old;
}

}  // namespace

std::set<KeyframeId> move_keyframes(Map& map,
                                    const KeyframePoses& new_poses,
                                    const std::function<bool(KeyframeId)>& follows,
                                    const std::map<LandmarkId, Eigen::Vector3d>& placed) {
  const auto T_new_old = motions(map, new_poses, follows);
  std::set<KeyframeId> moved;
  for (const auto& [id, T] : T_new_old) {
    for (const auto landmark_id : map.keyframe(id).frame.landmark_ids) {
      if (landmark_id == 0 || placed.contains(landmark_id)) continue;
      const auto& landmark = map.landmark(landmark_id);
      if (landmark.reference() != id) continue;
      tracking::Landmark turned = landmark.landmark;
      turned.f_map = (T.rotation() * turned.f_map.cast<double>()).cast<float>();
      map.set_appearance(landmark_id, turned);
      map.set_position(landmark_id, T * landmark.landmark.p_map);
    }
    moved.insert(id);
  }
  for (const auto& [id, T] : T_new_old) {
    const auto given = new_poses.find(id);
    map.set_pose(
        id, given != new_poses.end() ? given->second : T * map.keyframe(id).frame.T_map_camera);
  }
  for (const auto& [id, p_map] : placed) {
    if (map.find_landmark(id) != nullptr) map.set_position(id, p_map);
  }
  return moved;
}

}  // namespace camvox::mapping
