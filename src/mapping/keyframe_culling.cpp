#include <algorithm>

#include "camvox/mapping/keyframes.hpp"

namespace camvox::mapping {
namespace {

/// Whether `count` keyframes other than `id` see the landmark at the octave of `id` or finer.
bool seen_elsewhere(const Map& map, const MapLandmark& landmark, KeyframeId id, int count) {
  if (static_cast<int>(landmark.observations.size()) <= count) return false;
  int own_octave = 0;
  for (const auto& seen : landmark.observations) {
    if (seen.keyframe != id) continue;
    own_octave = map.keyframe(id).frame.features.key_points[seen.feature].octave;
  }
  for (const auto& seen : landmark.observations) {
    if (seen.keyframe == id) continue;
    const auto& points = map.keyframe(seen.keyframe).frame.features.key_points;
    if (points[seen.feature].octave <= own_octave + 1 && --count == 0) return true;
  }
  return false;
}

bool is_redundant(const Map& map, const ObservationModel& model, KeyframeId id) {
  const auto& frame = map.keyframe(id).frame;
  // Index 0: points without depth. They decide only where there is no depth at all.
  std::size_t points[2] = {0, 0};
  std::size_t redundant[2] = {0, 0};
  for (std::size_t i = 0; i < frame.landmark_ids.size(); ++i) {
    if (frame.landmark_ids[i] == 0) continue;
    const auto& landmark = map.landmark(frame.landmark_ids[i]);
    const int kind = model.observation(frame.features, i).depth_m > 0.0 ? 1 : 0;
    ++points[kind];
    if (seen_elsewhere(map, landmark, id, model.config().redundancy_observers)) ++redundant[kind];
  }
  const int kind = points[1] > 0 ? 1 : 0;
  if (points[kind] == 0) return false;
  return static_cast<double>(redundant[kind]) >
         model.config().max_redundancy * static_cast<double>(points[kind]);
}

}  // namespace

std::vector<KeyframeId> cull_keyframes(Map& map,
                                       const ObservationModel& model,
                                       KeyframeId id,
                                       const std::set<KeyframeId>& keep) {
  std::vector<KeyframeId> candidates;
  for (const auto& [other, shared] : map.keyframe(id).shared) candidates.push_back(other);
  std::vector<KeyframeId> culled;
  for (const auto candidate : candidates) {
    const bool is_root = map.keyframe(candidate).parent == 0;
    if (is_root || candidate == id || keep.contains(candidate)) continue;
    if (!is_redundant(map, model, candidate)) continue;
    map.remove_keyframe(candidate);
    culled.push_back(candidate);
  }
  return culled;
}

}  // namespace camvox::mapping
