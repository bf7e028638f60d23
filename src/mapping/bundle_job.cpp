#include "camvox/mapping/bundle_job.hpp"

#include <algorithm>
#include <unordered_map>

#include "camvox/mapping/keyframes.hpp"
#include "camvox/mapping/landmarks.hpp"

namespace camvox::mapping {
namespace {

/// The landmarks of these keyframes that are seen twice, those seen most often first.
std::vector<LandmarkId> shared_landmarks(const Map& map,
                                         const std::vector<KeyframeId>& keyframes,
                                         std::size_t limit) {
  std::vector<std::pair<std::size_t, LandmarkId>> ranked;
  const bool all = keyframes.size() == map.keyframes().size();
  for (const auto id : all ? map.landmark_ids() : landmarks_seen_by(map, keyframes)) {
    const std::size_t count = map.landmark(id).observations.size();
    if (count >= 2) ranked.emplace_back(count, id);
  }
  if (ranked.size() > limit) {
    std::sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    ranked.resize(limit);
  }
  std::vector<LandmarkId> ids;
  for (const auto& [count, id] : ranked) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

/// Keyframes outside of `free` that see most of the landmarks.
std::vector<KeyframeId> holders(const Map& map,
                                const std::vector<LandmarkId>& landmarks,
                                const std::set<KeyframeId>& free,
                                std::size_t limit) {
  std::map<KeyframeId, int> counts;
  for (const auto id : landmarks) {
    for (const auto& seen : map.landmark(id).observations) {
      if (!free.contains(seen.keyframe)) ++counts[seen.keyframe];
    }
  }
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [id, count] : counts) ranked.emplace_back(-count, id);
  std::sort(ranked.begin(), ranked.end());
  if (ranked.size() > limit) ranked.resize(limit);
  std::vector<KeyframeId> ids;
  for (const auto& [negative_count, id] : ranked) ids.push_back(id);
  return ids;
}

void add_poses(BundleJob& job, const Map& map, const std::set<KeyframeId>& ids, bool fixed) {
  for (const auto id : ids) {
    job.keyframes.push_back(id);
    job.problem.poses.push_back({map.keyframe(id).frame.T_map_camera, fixed});
  }
}

void add_landmarks(BundleJob& job,
                   const Map& map,
                   const ObservationModel& model,
                   const std::vector<LandmarkId>& landmarks) {
  // Of a large map there are a million observations: each is looked up once.
  struct Source {
    std::uint32_t pose;
    const features::FrameFeatures* features;
  };
  std::unordered_map<KeyframeId, Source> source_of;
  for (std::uint32_t i = 0; i < job.keyframes.size(); ++i) {
    source_of[job.keyframes[i]] = {i, &map.keyframe(job.keyframes[i]).frame.features};
  }
  std::size_t observations = 0;
  for (const auto id : landmarks) observations += map.landmark(id).observations.size();
  job.sightings.reserve(observations);
  job.problem.observations.reserve(observations);
  for (const auto id : landmarks) {
    const auto& landmark = map.landmark(id);
    const auto point = static_cast<std::uint32_t>(job.landmarks.size());
    const std::size_t before = job.sightings.size();
    for (const auto& seen : landmark.observations) {
      const auto source = source_of.find(seen.keyframe);
      if (source == source_of.end()) continue;
      job.sightings.push_back(seen);
      optimization::BundleObservation observation;
      observation.pose = source->second.pose;
      observation.point = point;
      observation.observation = model.observation(*source->second.features, seen.feature);
      job.problem.observations.push_back(observation);
    }
    if (job.sightings.size() == before) continue;
    job.landmarks.push_back(id);
    job.problem.points_world.push_back(landmark.landmark.p_map);
  }
}

BundleJob empty_job(const Map& map, const ObservationModel& model) {
  BundleJob job;
  job.problem.camera = model.camera().pinhole;
  job.problem.depth_model = model.depth_model();
  job.config = model.config().bundle;
  if (!map.keyframes().empty()) job.newest = map.keyframes().rbegin()->first;
  return job;
}

/// A job of the whole map also says where what it held is: local jobs may have moved that since.
KeyframePoses new_poses(const Map& map, const BundleJob& job) {
  KeyframePoses poses;
  for (std::size_t i = 0; i < job.keyframes.size(); ++i) {
    const auto* keyframe = map.find_keyframe(job.keyframes[i]);
    if (keyframe == nullptr) continue;
    const auto& pose = job.problem.poses[i];
    const bool moved = pose.T_world_camera.matrix() != keyframe->frame.T_map_camera.matrix();
    if (pose.fixed && !(job.whole_map && moved)) continue;
    poses[job.keyframes[i]] = pose.T_world_camera;
  }
  return poses;
}

void forget_outliers(Map& map, const BundleJob& job) {
  for (std::size_t i = 0; i < job.sightings.size(); ++i) {
    const auto& seen = job.sightings[i];
    if (!job.problem.observations[i].outlier) continue;
    const LandmarkId id = job.landmarks[job.problem.observations[i].point];
    const auto* keyframe = map.find_keyframe(seen.keyframe);
    if (keyframe != nullptr && map.find_landmark(id) != nullptr &&
        keyframe->frame.landmark_ids[seen.feature] == id) {
      map.forget(id, seen.keyframe);
    }
  }
}

}  // namespace

BundleJob make_local_job(const Map& map, const ObservationModel& model, KeyframeId id) {
  const auto& config = model.config();
  BundleJob job = empty_job(map, model);
  std::vector<KeyframeId> window = {id};
  for (const auto neighbour :
       map.neighbours(id, static_cast<std::size_t>(config.window_keyframes - 1))) {
    window.push_back(neighbour);
  }
  const std::set<KeyframeId> in_window(window.begin(), window.end());
  const auto landmarks =
      shared_landmarks(map, window, static_cast<std::size_t>(config.window_landmarks));
  const auto fixed =
      holders(map, landmarks, in_window, static_cast<std::size_t>(config.window_fixed_keyframes));

  // The map needs something that holds it: the others, or else the root or the oldest of the
  // window.
  const KeyframeId root = map.keyframes().begin()->first;
  std::set<KeyframeId> held(fixed.begin(), fixed.end());
  std::set<KeyframeId> free = in_window;
  const KeyframeId oldest = *in_window.begin();
  if (free.contains(root) || held.empty()) {
    held.insert(free.contains(root) ? root : oldest);
    free.erase(free.contains(root) ? root : oldest);
  }
  add_poses(job, map, free, false);
  add_poses(job, map, held, true);
  add_landmarks(job, map, model, landmarks);
  return job;
}

BundleJob make_full_job(const Map& map,
                        const ObservationModel& model,
                        const std::set<KeyframeId>& held) {
  BundleJob job = empty_job(map, model);
  job.whole_map = true;
  job.config.second_iterations = model.config().full_bundle_iterations;
  if (map.keyframes().empty()) return job;
  std::vector<KeyframeId> all;
  std::set<KeyframeId> fixed;
  std::set<KeyframeId> free;
  for (const auto& [id, keyframe] : map.keyframes()) {
    (all.empty() || held.contains(id) ? fixed : free).insert(id);
    all.push_back(id);
  }
  add_poses(job, map, fixed, true);
  add_poses(job, map, free, false);
  add_landmarks(job, map, model, shared_landmarks(map, all, map.landmark_count()));
  return job;
}

std::set<KeyframeId> apply_job(Map& map, const ObservationModel& model, const BundleJob& job) {
  const auto poses = new_poses(map, job);
  std::map<LandmarkId, Eigen::Vector3d> placed;
  for (std::size_t i = 0; i < job.landmarks.size(); ++i) {
    const auto& p_map = job.problem.points_world[i];
    if (map.find_landmark(job.landmarks[i]) != nullptr && p_map.allFinite()) {
      placed.emplace_hint(placed.end(), job.landmarks[i], p_map);
    }
  }
  const auto follows = [&](KeyframeId id) { return id > job.newest; };
  const auto moved = move_keyframes(map, poses, follows, placed);

  if (!job.keeps_outliers) forget_outliers(map, job);
  for (const auto id : job.landmarks) {
    if (map.find_landmark(id) != nullptr) refresh_landmark(map, model, id);
  }
  return moved;
}

}  // namespace camvox::mapping
