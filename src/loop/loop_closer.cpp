#include "camvox/loop/loop_closer.hpp"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "pose_graph_builder.hpp"

namespace camvox::loop {
namespace {

using geometry::SE3;
using geometry::Vector6d;

bool same_loop(const LoopMeasurement& a, const LoopMeasurement& b) {
  return a.query_id == b.query_id && a.match_id == b.match_id;
}

std::size_t size_of(int count) { return static_cast<std::size_t>(count); }

VerificationStatus to_verification_status(RegistrationStatus status) {
  switch (status) {
    case RegistrationStatus::kOk:
      return VerificationStatus::kOk;
    case RegistrationStatus::kNothing:
      return VerificationStatus::kNoRigidMotion;
    case RegistrationStatus::kNotDistinct:
      return VerificationStatus::kDepthDisagrees;
    case RegistrationStatus::kUncertain:
      return VerificationStatus::kUncertain;
  }
  return VerificationStatus::kNoRigidMotion;
}

VerifiedPlace verified_by_surfaces(const SurfaceTask& task,
                                   const optimization::PinholeCamera& camera,
                                   const SurfacePlacesConfig& config) {
  const auto registration = verify(task, camera, config);
  VerifiedPlace place;
  place.match_id = task.match_id;
  place.score = registration.distinction;
  place.by_surfaces = true;
  place.verification.status = to_verification_status(registration.status);
  place.verification.T_place_query = registration.T_target_source;
  place.verification.covariance_query = registration.covariance_source;
  place.verification.inliers = registration.points;
  return place;
}

}  // namespace

LoopCloser::LoopCloser(const LoopCloserConfig& config) : config_(config), index_(config.index) {
  config::require_valid(config);
  keyframes_since_correction_ = config.correction_interval;
}

void LoopCloser::insert(const tracking::Keyframe& keyframe) {
  if (map_.find(keyframe.id) != nullptr) index_.remove(keyframe.id);
  map_.insert(keyframe);
  index_.insert(keyframe.id, keyframe.features);
  recent_.push_back(keyframe.id);
  if (recent_.size() > size_of(config_.window_keyframes)) recent_.pop_front();
  ++keyframes_since_correction_;
}

void LoopCloser::update(const MapChange& change) {
  map_.apply(change);
  for (const auto id : change.removed) {
    index_.remove(id);
    const auto ends_here = [id](const LoopMeasurement& loop) {
      return loop.query_id == id || loop.match_id == id;
    };
    std::erase_if(pending_, ends_here);
    std::erase_if(loops_, ends_here);
    std::erase(recent_, id);
  }
}

MapReplica::Connections LoopCloser::loop_connections() const {
  MapReplica::Connections connections;
  for (const auto& loop : loops_) connections.emplace_back(loop.query_id, loop.match_id);
  return connections;
}

VerificationTask LoopCloser::detect(KeyframeId id) const {
  VerificationTask task;
  task.query_id = id;
  const auto* keyframe = map_.find(id);
  if (keyframe == nullptr) return task;
  task.query = keyframe->features;
  auto scores = index_.query(*keyframe->features);

  // What the map connects closely with the query is no loop, but shows how well places score here.
  auto near = map_.path_lengths(id, config_.min_path_m, {});
  for (const auto& [other, shared] : keyframe->shared_landmarks) near.emplace(other, 0.0);
  double reference = 0.0;
  for (const auto& score : scores) {
    if (score.keyframe_id != id && near.contains(score.keyframe_id)) {
      reference = std::max(reference, score.score);
    }
  }
  std::erase_if(scores, [&](const PlaceScore& score) {
    return near.contains(score.keyframe_id) || score.score < config_.min_score_ratio * reference ||
           score.matches < config_.verification.min_matches;
  });
  task.candidates = best_places(scores, size_of(config_.max_places));
  task.same_place_m = config_.min_path_m;
  task.surfaces = find_surface_place(map_, id, loop_connections(), config_.drift, config_.surfaces);
  return task;
}

VerificationTask LoopCloser::detect_lost(
    std::shared_ptr<const features::FrameFeatures> frame) const {
  VerificationTask task;
  task.query = std::move(frame);
  task.candidates = best_places(index_.query(*task.query), size_of(config_.max_places_lost));
  return task;
}

/// Keyframes of one place support each other: the best of each group of neighbours, ordered by
/// what the group has together.
std::vector<VerificationTask::Candidate> LoopCloser::best_places(
    const std::vector<PlaceScore>& scores, std::size_t count) const {
  std::map<KeyframeId, double> score_of;
  for (const auto& score : scores) score_of[score.keyframe_id] = score.score;
  struct Group {
    PlaceScore best;
    double score;
  };
  std::vector<Group> groups;
  std::set<KeyframeId> grouped;
  for (const auto& score : scores) {  // best first
    if (grouped.contains(score.keyframe_id)) continue;
    Group group{score, score.score};
    grouped.insert(score.keyframe_id);
    for (const auto neighbour : map_.neighbours(score.keyframe_id, 10)) {
      const auto found = score_of.find(neighbour);
      if (found != score_of.end() && grouped.insert(neighbour).second) group.score += found->second;
    }
    groups.push_back(group);
  }
  std::stable_sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
    return a.score > b.score;
  });
  std::vector<VerificationTask::Candidate> candidates;
  for (std::size_t i = 0; i < std::min(count, groups.size()); ++i) {
    candidates.push_back(candidate(groups[i].best));
  }
  return candidates;
}

VerificationTask::Candidate LoopCloser::candidate(const PlaceScore& score) const {
  VerificationTask::Candidate result;
  result.match_id = score.keyframe_id;
  result.score = score.score;
  result.p_map_match = map_.find(score.keyframe_id)->T_map_camera.translation();
  auto views = map_.neighbours(score.keyframe_id, size_of(config_.views_per_place) - 1);
  views.insert(views.begin(), score.keyframe_id);
  for (const auto id : views) {
    result.features.push_back(map_.find(id)->features);
    result.T_match_camera.push_back(map_.relative_pose(score.keyframe_id, id));
  }
  return result;
}

std::optional<CorrectionTask> LoopCloser::consider(KeyframeId id,
                                                   const std::vector<VerifiedPlace>& places) {
  forget_old(id);
  near_paths_m_.clear();
  far_paths_m_.clear();
  bool accepted = false;
  LoopMeasurement newest;
  for (const auto& measurement : plausible_measurements(id, places)) {
    const auto set = agreeing(measurement);
    pending_.push_back(measurement);
    std::set<KeyframeId> queries;
    for (const auto& loop : set) queries.insert(loop.query_id);
    if (queries.size() < size_of(config_.consistent_queries)) continue;
    if (!says_something_new(measurement)) continue;
    accepted = true;
    newest = measurement;
    accept(set);
  }
  if (!accepted || !due(newest)) return std::nullopt;
  keyframes_since_correction_ = 0;
  ++statistics_.corrections;
  return correction_task(newest);
}

void LoopCloser::accept(const std::vector<LoopMeasurement>& set) {
  for (const auto& loop : set) {
    const auto same = [&](const LoopMeasurement& other) { return same_loop(loop, other); };
    std::erase_if(pending_, same);
    if (std::any_of(loops_.begin(), loops_.end(), same) || !says_something_new(loop)) continue;
    loops_.push_back(loop);
    ++statistics_.loops;
    statistics_.surface_loops += loop.by_surfaces ? 1 : 0;
  }
}

/// Surfaces tell a pose to a decimetre, images to a centimetre. Where the map agrees with surfaces
/// within their error, it is the better of the two.
bool LoopCloser::says_something_new(const LoopMeasurement& loop) const {
  if (!loop.by_surfaces) return true;
  const Vector6d error =
      geometry::local(map_.relative_pose(loop.match_id, loop.query_id), loop.T_match_query);
  return error.dot(loop.covariance_query.llt().solve(error)) >
         config_.surfaces.min_correction * config_.surfaces.min_correction;
}

/// Measurements that the map's drift allows; none when they contradict each other.
std::vector<LoopMeasurement> LoopCloser::plausible_measurements(
    KeyframeId id, const std::vector<VerifiedPlace>& places) {
  std::vector<LoopMeasurement> measurements;
  std::map<KeyframeId, double> paths_m;
  for (const auto& place : places) {
    ++(place.by_surfaces ? statistics_.surfaces_compared : statistics_.places_verified);
    const bool known = map_.find(id) != nullptr && map_.find(place.match_id) != nullptr;
    if (!known || place.verification.status != VerificationStatus::kOk) continue;
    ++(place.by_surfaces ? statistics_.surfaces_confirmed : statistics_.places_confirmed);
    if (paths_m.empty()) {
      paths_m = map_.path_lengths(id, std::numeric_limits<double>::infinity(), loop_connections());
    }
    const LoopMeasurement measurement{id,
                                      place.match_id,
                                      place.verification.T_place_query,
                                      place.verification.covariance_query,
                                      place.verification.inliers,
                                      place.by_surfaces};
    const auto path_m = paths_m.find(place.match_id);
    if (path_m != paths_m.end() &&
        !plausible(
            measurement, map_.relative_pose(place.match_id, id), path_m->second, config_.drift)) {
      ++statistics_.implausible;
      continue;
    }
    measurements.push_back(measurement);
  }
  for (std::size_t i = 1; i < measurements.size(); ++i) {
    if (agree(measurements[0], measurements[i])) continue;
    ++statistics_.ambiguous;
    return {};
  }
  return measurements;
}

/// Of the path between two keyframes. Most are near each other, and found without a search of the
/// whole map.
double LoopCloser::path_length_m(KeyframeId from, KeyframeId to) const {
  constexpr double kNear_m = 60.0;
  constexpr double kNoPath_m = 1e3;
  const auto find = [&](Paths& paths, double max_m) {
    auto known = paths.find(from);
    if (known == paths.end()) {
      known = paths.emplace(from, map_.path_lengths(from, max_m, loop_connections())).first;
    }
    const auto found = known->second.find(to);
    return found == known->second.end() ? kNoPath_m : found->second;
  };
  const double near_m = find(near_paths_m_, kNear_m);
  if (near_m < kNoPath_m) return near_m;
  return find(far_paths_m_, std::numeric_limits<double>::infinity());
}

bool LoopCloser::agree(const LoopMeasurement& a, const LoopMeasurement& b) const {
  LoopPair pair;
  pair.a = &a;
  pair.b = &b;
  pair.T_query_a_query_b = map_.relative_pose(a.query_id, b.query_id);
  pair.T_match_a_match_b = map_.relative_pose(a.match_id, b.match_id);
  pair.query_path_m = path_length_m(a.query_id, b.query_id);
  pair.match_path_m = path_length_m(a.match_id, b.match_id);
  return consistent(pair, config_.drift);
}

/// The largest set of recent measurements that agree with the newest and with one another.
std::vector<LoopMeasurement> LoopCloser::agreeing(const LoopMeasurement& newest) const {
  std::vector<LoopMeasurement> others;
  const std::set<KeyframeId> recent(recent_.begin(), recent_.end());
  for (const auto* list : {&pending_, &loops_}) {
    for (const auto& loop : *list) {
      if (recent.contains(loop.query_id) && agree(newest, loop)) others.push_back(loop);
    }
  }
  std::vector<std::vector<bool>> adjacent(others.size(), std::vector<bool>(others.size(), false));
  for (std::size_t i = 0; i < others.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j)
      adjacent[i][j] = adjacent[j][i] = agree(others[i], others[j]);
  }
  std::vector<LoopMeasurement> set = {newest};
  for (const auto index : maximum_clique(adjacent)) set.push_back(others[index]);
  return set;
}

void LoopCloser::forget_old(KeyframeId newest) {
  const std::set<KeyframeId> recent(recent_.begin(), recent_.end());
  std::erase_if(pending_, [&](const LoopMeasurement& loop) {
    return loop.query_id != newest && !recent.contains(loop.query_id);
  });
}

bool LoopCloser::due(const LoopMeasurement& newest) const {
  if (keyframes_since_correction_ >= config_.correction_interval) return true;
  const SE3 T = map_.relative_pose(newest.match_id, newest.query_id);
  const Vector6d error = geometry::local(T, newest.T_match_query);
  const auto sigma = path_sigma(0.0, config_.drift);
  return error.head<3>().norm() > config_.urgent_sigma * sigma.rotation_rad ||
         error.tail<3>().norm() > config_.urgent_sigma * sigma.translation_m;
}

CorrectionTask LoopCloser::correction_task(const LoopMeasurement& newest) const {
  return build_correction(map_, loops_, newest, config_);
}

void LoopCloser::finish(const Correction& correction) {
  for (const auto& [query, match] : correction.rejected_loops) {
    statistics_.loops_left_out += std::erase_if(loops_, [&](const LoopMeasurement& loop) {
      return loop.query_id == query && loop.match_id == match;
    });
  }
}

std::optional<Relocalisation> LoopCloser::relocalise(
    const std::vector<VerifiedPlace>& places) const {
  const VerifiedPlace* best = nullptr;
  for (const auto& place : places) {
    const bool usable = place.verification.status == VerificationStatus::kOk &&
                        map_.find(place.match_id) != nullptr;
    if (!usable) continue;
    if (best == nullptr || place.verification.inliers > best->verification.inliers) best = &place;
  }
  if (best == nullptr) return std::nullopt;
  const SE3 T_map_camera =
      map_.find(best->match_id)->T_map_camera * best->verification.T_place_query;
  for (const auto& place : places) {
    if (&place == best || place.verification.status != VerificationStatus::kOk) continue;
    const auto* keyframe = map_.find(place.match_id);
    if (keyframe == nullptr) continue;
    const SE3 T_other = keyframe->T_map_camera * place.verification.T_place_query;
    const Vector6d error = geometry::local(T_map_camera, T_other);
    if (error.head<3>().norm() > config_.same_pose_deg * std::numbers::pi / 180.0 ||
        error.tail<3>().norm() > config_.same_pose_m) {
      return std::nullopt;
    }
  }
  Relocalisation answer;
  answer.T_map_camera = T_map_camera;
  answer.covariance_camera = best->verification.covariance_query;
  answer.inliers = best->verification.inliers;
  answer.keyframe_ids = map_.neighbours(best->match_id, 31);
  answer.keyframe_ids.insert(answer.keyframe_ids.begin(), best->match_id);
  return answer;
}

std::vector<VerifiedPlace> verify(const VerificationTask& task,
                                  const optimization::PinholeCamera& camera,
                                  const LoopCloserConfig& config) {
  std::vector<VerifiedPlace> places;
  std::vector<Eigen::Vector3d> confirmed;
  for (const auto& candidate : task.candidates) {
    const auto beside = [&](const Eigen::Vector3d& p_map) {
      return (p_map - candidate.p_map_match).norm() < task.same_place_m;
    };
    if (std::any_of(confirmed.begin(), confirmed.end(), beside)) continue;
    Place place;
    for (std::size_t i = 0; i < candidate.features.size(); ++i) {
      place.push_back({candidate.features[i].get(), candidate.T_match_camera[i]});
    }
    places.push_back({candidate.match_id,
                      candidate.score,
                      verify(*task.query, place, camera, config.verification)});
    if (places.back().verification.status == VerificationStatus::kOk) {
      confirmed.push_back(candidate.p_map_match);
    }
  }
  if (task.surfaces && confirmed.empty()) {
    places.push_back(verified_by_surfaces(*task.surfaces, camera, config.surfaces));
  }
  return places;
}

}  // namespace camvox::loop
