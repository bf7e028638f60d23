#include <algorithm>

#include "camvox/mapping/keyframes.hpp"

namespace camvox::mapping {
namespace {

constexpr std::size_t kSecondNeighbours = 10;

/// Keyframes around `centre`, the most important first.
std::vector<KeyframeId> surroundings(const Map& map, KeyframeId centre, std::size_t limit) {
  std::vector<KeyframeId> list = {centre};
  std::set<KeyframeId> listed = {centre};
  const auto add = [&](KeyframeId id) {
    if (id != 0 && list.size() < limit && listed.insert(id).second) list.push_back(id);
  };
  for (const auto id : map.neighbours(centre, limit)) add(id);
  const auto first = list;
  for (const auto id : first) {
    const auto& keyframe = map.keyframe(id);
    for (const auto second : map.neighbours(id, kSecondNeighbours)) add(second);
    for (const auto child : keyframe.children) add(child);
    add(keyframe.parent);
  }
  return list;
}

}  // namespace

tracking::LocalMap extract_local_map(const Map& map,
                                     const MappingConfig& config,
                                     KeyframeId reference) {
  tracking::LocalMap local;
  if (map.keyframes().empty()) return local;
  local.next_keyframe_id = map.keyframes().rbegin()->first + 1;
  auto anchor = map.anchor(reference);
  if (anchor.keyframe == 0) {
    reference = map.keyframes().rbegin()->first;
    anchor = {reference, {}};
  }
  local.reference_keyframe_id = reference;

  std::set<LandmarkId> taken;
  const auto landmark_limit = static_cast<std::size_t>(config.local_map_landmarks);
  for (const auto id :
       surroundings(map, anchor.keyframe, static_cast<std::size_t>(config.local_map_keyframes))) {
    const auto& frame = map.keyframe(id).frame;
    local.keyframes.push_back({id, frame.T_map_camera});
    for (const auto landmark : frame.landmark_ids) {
      if (landmark == 0 || taken.size() >= landmark_limit) continue;
      if (taken.insert(landmark).second) local.landmarks.push_back(map.landmark(landmark).landmark);
    }
  }
  if (anchor.keyframe != reference) {
    local.keyframes.push_back(
        {reference, map.keyframe(anchor.keyframe).frame.T_map_camera * anchor.T_keyframe_removed});
  }
  const auto by_id = [](const auto& a, const auto& b) { return a.id < b.id; };
  std::sort(local.keyframes.begin(), local.keyframes.end(), by_id);
  std::sort(local.landmarks.begin(), local.landmarks.end(), by_id);
  return local;
}

}  // namespace camvox::mapping
