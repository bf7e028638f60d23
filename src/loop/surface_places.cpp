#include "camvox/loop/surface_places.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace camvox::loop {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using geometry::SE3;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr double kSearchSigma = 2.5;
constexpr double kMinSearch_m = 1.0;

/// The views along the path past a keyframe, in the order in which they were taken.
SurfaceTask::Side side(const MapReplica& map, KeyframeId id, const SurfacePlacesConfig& config) {
  std::vector<std::pair<double, KeyframeId>> near;
  for (const auto& [other, path_m] : map.path_lengths(id, config.surroundings.reach_m, {})) {
    near.emplace_back(path_m, other);
  }
  std::sort(near.begin(), near.end());
  near.resize(std::min(near.size(), static_cast<std::size_t>(config.max_views)));
  std::sort(
      near.begin(), near.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  SurfaceTask::Side result;
  for (const auto& [path_m, other] : near) {
    if (other == id) result.centre = result.features.size();
    result.features.push_back(map.find(other)->features);
    result.T_keyframe_camera.push_back(map.relative_pose(id, other));
  }
  return result;
}

/// The nearest keyframe that looks elsewhere and that the path does not lead past soon; 0: none.
KeyframeId nearest_turned(const MapReplica& map,
                          KeyframeId query,
                          const SurfacePlacesConfig& config) {
  const auto& keyframe = *map.find(query);
  const Vector3d p_map = keyframe.T_map_camera.translation();
  const Vector3d ahead = keyframe.T_map_camera.rotation() * Vector3d::UnitZ();
  const double max_cosine = std::cos(kRadPerDeg * config.min_turn_deg);
  std::vector<std::pair<double, KeyframeId>> candidates;
  for (const auto& [id, other] : map.keyframes()) {
    const double distance_m = (other.T_map_camera.translation() - p_map).norm();
    if (distance_m > config.max_distance_m + config.max_search_m) continue;
    if (ahead.dot(other.T_map_camera.rotation() * Vector3d::UnitZ()) > max_cosine) continue;
    if (!keyframe.shared_landmarks.contains(id)) candidates.emplace_back(distance_m, id);
  }
  if (candidates.empty()) return 0;
  std::sort(candidates.begin(), candidates.end());
  const auto near = map.path_lengths(query, 2.0 * config.surroundings.reach_m, {});
  for (const auto& [distance_m, id] : candidates) {
    if (!near.contains(id)) return id;
  }
  return 0;
}

Surroundings look_around(const SurfaceTask::Side& side,
                         const optimization::PinholeCamera& camera,
                         const SurfacePlacesConfig& config) {
  std::vector<std::vector<Vector3f>> points;
  for (const auto& features : side.features) {
    points.push_back(surface_points(*features, camera, config.max_depth_m));
  }
  std::vector<SurfaceView> views;
  for (std::size_t i = 0; i < points.size(); ++i) {
    views.push_back({points[i], side.T_keyframe_camera[i]});
  }
  return gather(views, side.centre, config.surroundings);
}

/// The same robot at the same place is as high above the ground, and upright both times.
SE3 flat(const SE3& T) {
  const Eigen::Matrix3d R = T.rotation().matrix();
  return {geometry::SO3::exp({0.0, 0.0, std::atan2(R(1, 0), R(0, 0))}),
          Vector3d(T.translation().x(), T.translation().y(), 0.0)};
}

}  // namespace

std::optional<SurfaceTask> find_surface_place(const MapReplica& map,
                                              KeyframeId query,
                                              const MapReplica::Connections& loops,
                                              const DriftConfig& drift,
                                              const SurfacePlacesConfig& config) {
  const bool its_turn = query % static_cast<KeyframeId>(config.every_keyframes) == 0;
  if (!config.enabled || !its_turn || map.find(query) == nullptr) return std::nullopt;
  const KeyframeId match = nearest_turned(map, query, config);
  if (match == 0) return std::nullopt;
  constexpr double kEverywhere = std::numeric_limits<double>::infinity();
  const auto paths_m = map.path_lengths(query, kEverywhere, loops);
  const auto path_m = paths_m.find(match);
  PoseSigma off{kEverywhere, kEverywhere};
  if (path_m != paths_m.end()) off = path_sigma(path_m->second, drift);
  SurfaceTask task;
  task.match_id = match;
  task.T_match_query = map.relative_pose(match, query);
  task.search_m = std::clamp(kSearchSigma * off.translation_m, kMinSearch_m, config.max_search_m);
  task.search_yaw_rad =
      std::min(kSearchSigma * off.rotation_rad, kRadPerDeg * config.max_search_deg);
  if (task.T_match_query.translation().norm() > config.max_distance_m + task.search_m) {
    return std::nullopt;
  }
  task.query = side(map, query, config);
  task.match = side(map, match, config);
  return task;
}

Registration verify(const SurfaceTask& task,
                    const optimization::PinholeCamera& camera,
                    const SurfacePlacesConfig& config) {
  const auto query = look_around(task.query, camera, config);
  const auto match = look_around(task.match, camera, config);
  const RegistrationStart start{
      flat(match.T_place_level.inverse() * task.T_match_query * query.T_place_level),
      task.search_m,
      task.search_yaw_rad};
  auto result = register_surfaces(
      SurfaceMap(query.points_level), SurfaceMap(match.points_level), start, config.registration);
  // From the level frames to the cameras.
  result.T_target_source =
      match.T_place_level * result.T_target_source * query.T_place_level.inverse();
  const geometry::Matrix6d adjoint = query.T_place_level.adjoint();
  const PoseSigma base{kRadPerDeg * config.base_sigma_deg, config.base_sigma_m};
  result.covariance_source =
      adjoint * result.covariance_source * adjoint.transpose() + base.covariance();
  return result;
}

}  // namespace camvox::loop
