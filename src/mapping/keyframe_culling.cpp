#include <algorithm>
#include <limits>

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

/// Views that differ by less, as distance over depth plus angle, are of one place.
constexpr double kSamePlace = 0.2;

double median_depth_m(const tracking::Keyframe& frame) {
  std::vector<float> depths_m;
  for (const float depth_m : frame.features.depth_m) {
    if (depth_m > 0.0F) depths_m.push_back(depth_m);
  }
  if (depths_m.empty()) return 1.0;
  const auto middle = depths_m.begin() + static_cast<std::ptrdiff_t>(depths_m.size() / 2);
  std::nth_element(depths_m.begin(), middle, depths_m.end());
  return static_cast<double>(*middle);
}

std::vector<KeyframeId> keyframes_at_place_of(const Map& map, KeyframeId id) {
  const auto& frame = map.keyframe(id).frame;
  const double depth_m = median_depth_m(frame);
  const geometry::SE3 T_camera_map = frame.T_map_camera.inverse();
  std::vector<KeyframeId> place;
  for (const auto& [other, keyframe] : map.keyframes()) {
    const geometry::SE3 T = T_camera_map * keyframe.frame.T_map_camera;
    if (T.translation().norm() / depth_m > kSamePlace) continue;
    if (T.translation().norm() / depth_m + T.rotation().angle_rad() < kSamePlace) {
      place.push_back(other);
    }
  }
  return place;
}

/// What the map would lose: landmarks that few others see, each by how often it was found where it
/// should be.
double own_value(const Map& map, const ObservationModel& model, KeyframeId id) {
  double value = 0.0;
  for (const auto landmark_id : map.keyframe(id).frame.landmark_ids) {
    if (landmark_id == 0) continue;
    const auto& landmark = map.landmark(landmark_id);
    if (seen_elsewhere(map, landmark, id, model.config().redundancy_observers)) continue;
    value += static_cast<double>(landmark.found) / static_cast<double>(landmark.visible);
  }
  return value;
}

/// The least valuable of `place`; 0 when all must stay.
template <typename MustStay>
KeyframeId least_valuable(const Map& map,
                          const ObservationModel& model,
                          const std::vector<KeyframeId>& place,
                          const MustStay& must_stay) {
  KeyframeId least = 0;
  double least_value = std::numeric_limits<double>::infinity();
  for (const auto id : place) {
    if (must_stay(id)) continue;
    const double value = own_value(map, model, id);
    if (value >= least_value) continue;
    least_value = value;
    least = id;
  }
  return least;
}

}  // namespace

std::vector<KeyframeId> cull_keyframes(Map& map,
                                       const ObservationModel& model,
                                       KeyframeId id,
                                       const std::set<KeyframeId>& keep) {
  std::vector<KeyframeId> candidates;
  for (const auto& [other, shared] : map.keyframe(id).shared) candidates.push_back(other);
  const auto must_stay = [&](KeyframeId each) {
    return map.keyframe(each).parent == 0 || each == id || keep.contains(each);
  };
  std::vector<KeyframeId> culled;
  for (const auto candidate : candidates) {
    if (must_stay(candidate) || !is_redundant(map, model, candidate)) continue;
    map.remove_keyframe(candidate);
    culled.push_back(candidate);
  }
  auto place = keyframes_at_place_of(map, id);
  while (place.size() > static_cast<std::size_t>(model.config().place_keyframes)) {
    const KeyframeId least = least_valuable(map, model, place, must_stay);
    if (least == 0) break;
    map.remove_keyframe(least);
    culled.push_back(least);
    std::erase(place, least);
  }
  std::sort(culled.begin(), culled.end());
  return culled;
}

}  // namespace camvox::mapping
