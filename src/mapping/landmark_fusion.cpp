#include <algorithm>
#include <cmath>

#include "camvox/features/match.hpp"
#include "camvox/mapping/landmarks.hpp"

namespace camvox::mapping {
namespace {

constexpr std::size_t kMaxFusionKeyframes = 20;
constexpr double kDepthSigmas = 4.0;
constexpr double kDepthSlack = 0.01;  // of the distance: poses are not exact either

/// Whether the feature's own depth, if it has one, allows the landmark there.
bool depth_agrees(const optimization::PointObservation& observation,
                  const ObservationModel::Sight& sight,
                  double landmark_sigma_m,
                  const ObservationModel& model) {
  if (observation.depth_m <= 0.0) return true;
  const double sigma_m = std::hypot(model.depth_sigma_m(observation), landmark_sigma_m);
  return std::abs(observation.depth_m - sight.depth_m) <
         kDepthSigmas * sigma_m + kDepthSlack * sight.depth_m;
}

bool is_seen_by(const MapLandmark& landmark, KeyframeId id) {
  return std::any_of(landmark.observations.begin(),
                     landmark.observations.end(),
                     [id](const auto& seen) { return seen.keyframe == id; });
}

/// Makes one of two landmarks; returns the id that stays.
LandmarkId fuse_pair(Map& map, LandmarkId a, LandmarkId b) {
  const std::size_t count_a = map.landmark(a).observations.size();
  const std::size_t count_b = map.landmark(b).observations.size();
  const bool a_stays = count_a > count_b || (count_a == count_b && a < b);
  map.fuse(a_stays ? b : a, a_stays ? a : b);
  return a_stays ? a : b;
}

}  // namespace

std::size_t fuse_into(Map& map,
                      const ObservationModel& model,
                      KeyframeId id,
                      std::span<const LandmarkId> landmarks,
                      double radius_px) {
  const MapKeyframe& keyframe = map.keyframe(id);
  const auto& T_map_camera = keyframe.frame.T_map_camera;
  std::vector<features::Expected> expected;
  std::vector<LandmarkId> ids;
  std::vector<ObservationModel::Sight> sights;
  for (const auto landmark_id : landmarks) {
    const MapLandmark* landmark = map.find_landmark(landmark_id);
    if (landmark == nullptr || is_seen_by(*landmark, id)) continue;
    const auto sight = model.sees(T_map_camera, landmark->landmark);
    if (!sight) continue;
    const int octave = tracking::predicted_octave(static_cast<float>(sight->distance_m),
                                                  landmark->landmark.max_distance_m,
                                                  model.camera().scale);
    features::Expected entry;
    entry.area = {sight->u_px.cast<float>(),
                  static_cast<float>(radius_px * model.scale(octave)),
                  std::max(octave - 1, 0),
                  octave + 1};
    entry.descriptor = landmark->landmark.descriptor;
    expected.push_back(entry);
    ids.push_back(landmark_id);
    sights.push_back(*sight);
  }
  const features::MatchConfig config{
      .max_distance = features::kStrictDistance, .max_ratio = 1.0, .check_rotation = false};
  const auto matches =
      features::match_by_projection(expected, keyframe.frame.features, keyframe.grid, {}, config);

  std::size_t changed = 0;
  for (const auto& match : matches) {
    const LandmarkId landmark = map.resolve(ids[match.query]);
    if (landmark == 0 || is_seen_by(map.landmark(landmark), id)) continue;
    const auto observation = model.observation(keyframe.frame.features, match.target);
    const double sigma_m = map.landmark(landmark).landmark.sigma_m;
    if (!depth_agrees(observation, sights[match.query], sigma_m, model)) continue;
    const LandmarkId shown = keyframe.frame.landmark_ids[match.target];
    LandmarkId staying = landmark;
    if (shown == 0) {
      map.observe(landmark, {id, match.target});
    } else {
      staying = fuse_pair(map, shown, landmark);
    }
    refresh_landmark(map, model, staying);
    ++changed;
  }
  return changed;
}

std::size_t fuse_with_neighbours(Map& map, const ObservationModel& model, KeyframeId id) {
  const auto& config = model.config();
  auto targets = map.neighbours(id, static_cast<std::size_t>(config.fusion_neighbours));
  const auto first = targets;
  for (const auto neighbour : first) {
    for (const auto second :
         map.neighbours(neighbour, static_cast<std::size_t>(config.fusion_second_neighbours))) {
      const bool known = std::find(targets.begin(), targets.end(), second) != targets.end();
      if (second != id && !known && targets.size() < kMaxFusionKeyframes) targets.push_back(second);
    }
  }
  std::size_t changed = 0;
  const std::vector<KeyframeId> own = {id};
  for (const auto target : targets) {
    changed += fuse_into(map, model, target, landmarks_seen_by(map, own), config.fusion_radius_px);
  }
  changed += fuse_into(map, model, id, landmarks_seen_by(map, targets), config.fusion_radius_px);
  return changed;
}

}  // namespace camvox::mapping
