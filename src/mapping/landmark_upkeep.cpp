#include <algorithm>
#include <cmath>

#include "camvox/features/hamming.hpp"
#include "camvox/mapping/landmarks.hpp"

namespace camvox::mapping {
namespace {

/// Descriptors that stand for a landmark's; more cost time and change nothing.
constexpr std::size_t kMaxDescriptors = 12;
/// Errors of neighbouring depths are alike, so averaging helps only so far.
constexpr double kMaxAveraging = 0.5;
constexpr KeyframeId kYoungKeyframes = 3;

features::Descriptor typical_descriptor(const Map& map, const MapLandmark& landmark) {
  std::vector<features::Descriptor> descriptors;
  const std::size_t count = landmark.observations.size();
  const std::size_t taken = std::min(count, kMaxDescriptors);
  for (std::size_t k = 0; k < taken; ++k) {
    const auto& seen = landmark.observations[k * count / taken];
    descriptors.push_back(map.keyframe(seen.keyframe).frame.features.descriptors[seen.feature]);
  }
  const int best = features::median_descriptor(descriptors);
  return best < 0 ? landmark.landmark.descriptor : descriptors[static_cast<std::size_t>(best)];
}

/// One over the variance along the unit vector `f_map` that an observation gives: its depth, and
/// its pixel as far as the camera looks from aside.
double information_along(const Eigen::Vector3d& f_map,
                         const Eigen::Vector3d& ray_map,
                         const optimization::PointObservation& observation,
                         const ObservationModel& model) {
  const double distance = ray_map.norm();
  const double sine = f_map.cross(ray_map).norm() / distance;
  const double px_per_m = model.camera().pinhole.fx_px / distance * sine / observation.sigma_px;
  double information = px_per_m * px_per_m;
  if (observation.depth_m > 0.0) {
    const double sigma_m = model.depth_sigma_m(observation);
    information += 1.0 / (sigma_m * sigma_m);
  }
  return information;
}

}  // namespace

void refresh_landmark(Map& map, const ObservationModel& model, LandmarkId id) {
  const MapLandmark& current = map.landmark(id);
  tracking::Landmark landmark = current.landmark;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& seen : current.observations) {
    const auto& T_map_camera = map.keyframe(seen.keyframe).frame.T_map_camera;
    sum += (landmark.p_map - T_map_camera.translation()).normalized();
  }
  if (!(sum.norm() > 1e-9)) return;
  const Eigen::Vector3d f_map = sum.normalized();
  double information = 0.0;
  double best_depth_sigma_m = 0.0;
  for (const auto& seen : current.observations) {
    const auto& frame = map.keyframe(seen.keyframe).frame;
    const auto observation = model.observation(frame.features, seen.feature);
    const Eigen::Vector3d ray = landmark.p_map - frame.T_map_camera.translation();
    information += information_along(f_map, ray, observation, model);
    if (observation.depth_m > 0.0) {
      const double sigma_m = model.depth_sigma_m(observation);
      if (best_depth_sigma_m == 0.0 || sigma_m < best_depth_sigma_m) best_depth_sigma_m = sigma_m;
    }
  }
  if (information > 0.0) {
    const double sigma_m =
        std::max(1.0 / std::sqrt(information), kMaxAveraging * best_depth_sigma_m);
    landmark.sigma_m = static_cast<float>(sigma_m);
  }
  const auto& reference = current.observations.front();
  const auto& frame = map.keyframe(reference.keyframe).frame;
  const auto range = tracking::distance_range(
      static_cast<float>((landmark.p_map - frame.T_map_camera.translation()).norm()),
      frame.features.key_points[reference.feature].octave,
      model.camera().scale);
  landmark.f_map = f_map.cast<float>();
  landmark.min_distance_m = range.min_m;
  landmark.max_distance_m = range.max_m;
  landmark.descriptor = typical_descriptor(map, current);
  map.set_appearance(id, landmark);
}

void refresh_landmarks_of(Map& map, const ObservationModel& model, KeyframeId id) {
  for (const auto landmark : map.keyframe(id).frame.landmark_ids) {
    if (landmark != 0) refresh_landmark(map, model, landmark);
  }
}

std::vector<LandmarkId> landmarks_seen_by(const Map& map, std::span<const KeyframeId> keyframes) {
  std::vector<LandmarkId> ids;
  for (const auto keyframe : keyframes) {
    for (const auto id : map.keyframe(keyframe).frame.landmark_ids) {
      if (id != 0) ids.push_back(id);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

void count_sightings(Map& map, const ObservationModel& model, KeyframeId id) {
  const auto neighbours = map.neighbours(id, 10);
  const auto& T_map_camera = map.keyframe(id).frame.T_map_camera;
  for (const auto landmark_id : landmarks_seen_by(map, neighbours)) {
    const auto& landmark = map.landmark(landmark_id);
    const bool found =
        std::binary_search(landmark.observations.begin(),
                           landmark.observations.end(),
                           Observation{id, 0},
                           [](const auto& a, const auto& b) { return a.keyframe < b.keyframe; });
    if (found || model.sees(T_map_camera, landmark.landmark)) map.count_visible(landmark_id, found);
  }
}

std::size_t cull_young_landmarks(Map& map, const ObservationModel& model, KeyframeId newest) {
  std::vector<KeyframeId> young_keyframes;
  for (auto entry = map.keyframes().rbegin();
       entry != map.keyframes().rend() && young_keyframes.size() < kYoungKeyframes + 1;
       ++entry) {
    young_keyframes.push_back(entry->first);
  }
  std::size_t culled = 0;
  for (const auto id : landmarks_seen_by(map, young_keyframes)) {
    const auto& landmark = map.landmark(id);
    const KeyframeId age = newest - landmark.born_at;
    if (age > kYoungKeyframes) continue;
    int weight = 0;
    for (const auto& seen : landmark.observations) {
      const auto& features = map.keyframe(seen.keyframe).frame.features;
      weight += model.observation(features, seen.feature).depth_m > 0.0 ? 2 : 1;
    }
    const bool seldom = landmark.found < model.config().min_found_ratio * landmark.visible;
    const bool by_few = age >= 2 && weight <= model.config().min_observations;
    if (!seldom && !by_few) continue;
    map.remove_landmark(id);
    ++culled;
  }
  return culled;
}

}  // namespace camvox::mapping
