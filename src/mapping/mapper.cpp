#include "camvox/mapping/mapper.hpp"

#include <algorithm>

#include "camvox/mapping/landmarks.hpp"

namespace camvox::mapping {
namespace {

constexpr std::size_t kLoopNeighbours = 10;
constexpr KeyframeId kProtectedNewest = 3;
constexpr int kMinShared = 15;

bool is_finite(const geometry::SE3& T) {
  return T.translation().allFinite() && T.rotation().quaternion().coeffs().allFinite();
}

}  // namespace

Mapper::Mapper(const MappingConfig& config, const tracking::TrackingCamera& camera)
    : model_(config, camera) {}

std::string Mapper::problem_with(const tracking::Keyframe& keyframe) const {
  const auto& features = keyframe.features;
  const std::size_t count = features.size();
  if (keyframe.id == 0) return "a keyframe without an id";
  if (map_.find_keyframe(keyframe.id) != nullptr) return "a keyframe with an id that is taken";
  if (!map_.keyframes().empty() && keyframe.id < map_.keyframes().rbegin()->first) {
    return "a keyframe with an id lower than that of the one before";
  }
  const bool equal = features.undistorted_px.size() == count &&
                     features.descriptors.size() == count && features.depth_m.size() == count &&
                     features.depth_sigma_m.size() == count &&
                     keyframe.landmark_ids.size() == count;
  if (!equal || count > 65536) return "lists of different length, or more than 65536 features";
  if (!is_finite(keyframe.T_map_camera) || !is_finite(keyframe.T_parent_camera)) {
    return "a pose that is not finite";
  }
  return {};
}

void Mapper::attach_landmarks(const tracking::Keyframe& keyframe, InsertReport& report) {
  for (std::uint32_t i = 0; i < keyframe.landmark_ids.size(); ++i) {
    const LandmarkId given = keyframe.landmark_ids[i];
    if (given == 0) continue;
    if (given == tracking::landmark_id(keyframe.id, i)) {
      const auto landmark = tracking::landmark_from_depth(
          keyframe, i, model_.camera().pinhole, model_.camera().scale);
      if (!landmark) continue;
      map_.add_landmark(*landmark, {keyframe.id, i}, keyframe.id);
      ++report.from_depth;
    } else if (const LandmarkId id = map_.resolve(given); id != 0) {
      if (map_.observe(id, {keyframe.id, i})) ++report.observed;
    }
  }
}

void Mapper::choose_parent(KeyframeId id) {
  if (map_.keyframe(id).parent == 0) return;
  const auto best = map_.neighbours(id, 1);
  if (!best.empty() && map_.keyframe(id).children.empty()) map_.set_parent(id, best.front());
}

InsertReport Mapper::insert(const tracking::Keyframe& given) {
  InsertReport report;
  report.problem = problem_with(given);
  if (!report.problem.empty()) return report;
  report.inserted = true;

  tracking::Keyframe keyframe = given;
  const auto parent = map_.anchor(keyframe.parent_id);
  if (parent.keyframe != 0) {
    keyframe.T_map_camera = map_.keyframe(parent.keyframe).frame.T_map_camera *
                            parent.T_keyframe_removed * keyframe.T_parent_camera;
  }
  map_.add_keyframe(keyframe, parent.keyframe);
  attach_landmarks(keyframe, report);
  count_sightings(map_, model_, keyframe.id);
  choose_parent(keyframe.id);
  report.culled = cull_young_landmarks(map_, model_, keyframe.id);
  refresh_landmarks_of(map_, model_, keyframe.id);
  report.triangulated = triangulate_landmarks(map_, model_, keyframe.id);
  report.fused = fuse_with_neighbours(map_, model_, keyframe.id);
  changed_.insert(keyframe.id);
  note_edges_of(keyframe.id);
  return report;
}

InsertReport Mapper::process(const tracking::Keyframe& keyframe) {
  auto report = insert(keyframe);
  if (!report.inserted) return report;
  auto job = local_job(keyframe.id);
  (void)job.solve();
  finish(job);
  cull_keyframes(keyframe.id);
  return report;
}

BundleJob Mapper::local_job(KeyframeId id) const {
  const KeyframeId there = map_.anchor(id).keyframe;
  if (there == 0) return {};
  auto job = make_local_job(map_, model_, there);
  job.map_epoch = epoch_;
  job.full_jobs = full_jobs_;
  return job;
}

BundleJob Mapper::full_job() const {
  auto job = make_full_job(map_, model_, loop_ends());
  job.map_epoch = epoch_;
  return job;
}

std::set<KeyframeId> Mapper::loop_ends() const {
  std::set<KeyframeId> there;
  for (const auto id : loop_ends_) there.insert(map_.anchor(id).keyframe);
  there.erase(0);  // gone for too long
  return there;
}

bool Mapper::finish(const BundleJob& job) {
  const bool outdated = !job.whole_map && job.full_jobs != full_jobs_;
  if (job.map_epoch != epoch_ || outdated || job.empty()) return false;
  if (job.whole_map) ++full_jobs_;
  const auto moved = apply_job(map_, model_, job);
  changed_.insert(moved.begin(), moved.end());
  return true;
}

std::size_t Mapper::cull_keyframes(KeyframeId id) {
  id = map_.anchor(id).keyframe;
  if (id == 0) return 0;
  std::set<KeyframeId> keep = {map_.anchor(tracker_reference_).keyframe};
  auto newest = map_.keyframes().rbegin();
  for (KeyframeId i = 0; i < kProtectedNewest && newest != map_.keyframes().rend(); ++i, ++newest) {
    keep.insert(newest->first);
  }
  const auto culled = mapping::cull_keyframes(map_, model_, id, keep);
  for (const auto gone : culled) {
    removed_.insert(gone);
    changed_.erase(gone);
  }
  std::erase_if(changed_edges_, [&](const auto& edge) {
    return map_.find_keyframe(edge.first) == nullptr || map_.find_keyframe(edge.second) == nullptr;
  });
  return culled.size();
}

void Mapper::fuse_across(KeyframeId query, KeyframeId match) {
  const auto side = [&](KeyframeId id) {
    auto keyframes = map_.neighbours(id, kLoopNeighbours);
    keyframes.push_back(id);
    std::sort(keyframes.begin(), keyframes.end());
    return keyframes;
  };
  const auto query_side = side(query);
  const auto match_side = side(match);
  const auto old_landmarks = landmarks_seen_by(map_, match_side);
  for (const auto id : query_side) {
    fuse_into(map_, model_, id, old_landmarks, model_.config().loop_fusion_radius_px);
  }
  const auto new_landmarks = landmarks_seen_by(map_, query_side);
  for (const auto id : match_side) {
    fuse_into(map_, model_, id, new_landmarks, model_.config().loop_fusion_radius_px);
  }
  for (const auto& keyframes : {query_side, match_side}) {
    for (const auto id : keyframes) note_edges_of(id);
  }
}

std::string Mapper::correct(const LoopProposal& proposal) {
  if (proposal.map_epoch != epoch_) {
    return "it is for map epoch " + std::to_string(proposal.map_epoch) + ", the map is at " +
           std::to_string(epoch_);
  }
  const KeyframeId query = map_.anchor(proposal.query).keyframe;
  const KeyframeId match = map_.anchor(proposal.match).keyframe;
  if (query == 0 || match == 0) return "its keyframes are not in the map";
  KeyframePoses poses;
  for (const auto& [id, T_map_camera] : proposal.poses) {
    if (!is_finite(T_map_camera)) return "a pose in it is not finite";
    if (map_.find_keyframe(id) != nullptr) poses[id] = T_map_camera;
  }
  const auto moved = move_keyframes(map_, poses, [](KeyframeId) { return true; });
  changed_.insert(moved.begin(), moved.end());
  ++epoch_;
  if (proposal.by_surfaces) {
    loop_ends_.insert({query, match});
  } else {
    fuse_across(query, match);
  }
  return {};
}

tracking::LocalMap Mapper::local_map(std::uint64_t frame_id, KeyframeId reference) const {
  auto local = extract_local_map(map_, model_.config(), reference);
  local.frame_id = frame_id;
  local.map_epoch = epoch_;
  return local;
}

int Mapper::shared_count(KeyframeId a, KeyframeId b) const {
  const auto& shared = map_.keyframe(a).shared;
  const auto found = shared.find(b);
  return found == shared.end() ? 0 : found->second;
}

void Mapper::note_edges_of(KeyframeId id) {
  for (const auto& [other, count] : map_.keyframe(id).shared) {
    if (count >= kMinShared) changed_edges_.insert(std::minmax(id, other));
  }
  const KeyframeId parent = map_.keyframe(id).parent;
  if (parent != 0) changed_edges_.insert(std::minmax(id, parent));
}

MapChanges Mapper::take_changes() {
  MapChanges changes;
  for (const auto id : changed_) {
    if (const auto* keyframe = map_.find_keyframe(id)) {
      changes.keyframes.push_back({id, keyframe->frame.T_map_camera});
    }
  }
  changes.removed.assign(removed_.begin(), removed_.end());
  for (const auto& [a, b] : changed_edges_) changes.edges.push_back({a, b, shared_count(a, b)});
  changed_.clear();
  removed_.clear();
  changed_edges_.clear();
  return changes;
}

MapChanges Mapper::all_changes() const {
  MapChanges changes;
  for (const auto& [id, keyframe] : map_.keyframes()) {
    changes.keyframes.push_back({id, keyframe.frame.T_map_camera});
    for (const auto& [other, count] : keyframe.shared) {
      if (other > id && count >= kMinShared) changes.edges.push_back({id, other, count});
    }
  }
  return changes;
}

void Mapper::restore(Map map, std::uint64_t epoch, std::set<KeyframeId> loop_ends) {
  map_ = std::move(map);
  epoch_ = epoch;
  tracker_reference_ = 0;
  loop_ends_ = std::move(loop_ends);
  changed_.clear();
  removed_.clear();
  changed_edges_.clear();
}

}  // namespace camvox::mapping
