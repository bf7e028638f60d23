#include "camvox/loop/map_replica.hpp"

#include <algorithm>
#include <limits>
#include <queue>
#include <stdexcept>
#include <string>
#include <unordered_map>

namespace camvox::loop {
namespace {

using geometry::SE3;

/// Keyframes that share fewer landmarks are not connected by them.
constexpr int kMinShared = 15;

}  // namespace

void MapReplica::insert(const tracking::Keyframe& keyframe) {
  const auto [place, is_new] = keyframes_.try_emplace(keyframe.id);
  auto& mine = place->second;
  mine.features = std::make_shared<const features::FrameFeatures>(keyframe.features);
  mine.T_map_camera = keyframe.T_map_camera;
  mine.covariance = keyframe.covariance_camera;
  if (!is_new) return;
  adopt(keyframe.parent_id, keyframe.id);
  if (const auto next = std::next(place); next != keyframes_.end()) {
    const bool stood_in_for = next->second.parent == 0 || next->second.awaited_parent != 0;
    if (stood_in_for) adopt(next->second.awaited_parent, next->first);  // this one is nearer
  }
  const auto waiting = awaited_.find(keyframe.id);
  if (waiting == awaited_.end()) return;
  const auto children = std::move(waiting->second);
  awaited_.erase(waiting);
  for (const auto child : children) adopt(keyframe.id, child);
}

/// Parents are older than their children: so there is no circle, and all hangs together.
void MapReplica::adopt(KeyframeId parent, KeyframeId child) {
  const auto at = keyframes_.find(child);
  if (at == keyframes_.end()) return;  // removed while its parent was awaited
  auto& mine = at->second;
  if (const auto old = keyframes_.find(mine.parent); old != keyframes_.end()) {
    std::erase(old->second.children, child);
  }
  const bool sensible = parent != 0 && parent < child;
  const bool known = sensible && keyframes_.contains(parent);
  mine.awaited_parent = sensible && !known ? parent : 0;
  if (mine.awaited_parent != 0) awaited_[parent].insert(child);
  const KeyframeId predecessor = at == keyframes_.begin() ? 0 : std::prev(at)->first;
  mine.parent = known ? parent : predecessor;
  if (mine.parent != 0) keyframes_.at(mine.parent).children.push_back(child);
}

void MapReplica::apply(const MapChange& change) {
  map_epoch_ = std::max(map_epoch_, change.map_epoch);
  for (const auto& [id, T_map_camera] : change.T_map_camera) {
    const auto found = keyframes_.find(id);
    if (found != keyframes_.end()) found->second.T_map_camera = T_map_camera;
  }
  for (const auto& edge : change.edges) {
    const auto a = keyframes_.find(edge.a);
    const auto b = keyframes_.find(edge.b);
    if (a == keyframes_.end() || b == keyframes_.end() || a == b) continue;
    if (edge.shared_landmarks > 0) {
      a->second.shared_landmarks[edge.b] = edge.shared_landmarks;
      b->second.shared_landmarks[edge.a] = edge.shared_landmarks;
    } else {
      a->second.shared_landmarks.erase(edge.b);
      b->second.shared_landmarks.erase(edge.a);
    }
  }
  for (const auto id : change.removed) remove(id);
}

void MapReplica::remove(KeyframeId id) {
  const auto found = keyframes_.find(id);
  if (found == keyframes_.end()) return;
  const Keyframe gone = std::move(found->second);
  keyframes_.erase(found);
  for (const auto& [other, shared] : gone.shared_landmarks) {
    keyframes_.at(other).shared_landmarks.erase(id);
  }
  if (const auto parent = keyframes_.find(gone.parent); parent != keyframes_.end()) {
    std::erase(parent->second.children, id);
  }
  for (const auto child : gone.children) {
    const auto awaited = keyframes_.at(child).awaited_parent;
    adopt(awaited != 0 ? awaited : gone.parent, child);
  }
}

const MapReplica::Keyframe* MapReplica::find(KeyframeId id) const {
  const auto found = keyframes_.find(id);
  return found == keyframes_.end() ? nullptr : &found->second;
}

std::vector<KeyframeId> MapReplica::neighbours(KeyframeId id, std::size_t count) const {
  const auto* keyframe = find(id);
  if (keyframe == nullptr) return {};
  std::vector<std::pair<int, KeyframeId>> shared;
  for (const auto& [other, landmarks] : keyframe->shared_landmarks) {
    if (landmarks >= kMinShared) shared.emplace_back(-landmarks, other);
  }
  std::sort(shared.begin(), shared.end());
  std::vector<KeyframeId> result;
  const auto add = [&](KeyframeId other) {
    const bool known = std::find(result.begin(), result.end(), other) != result.end();
    if (other != 0 && !known && result.size() < count) result.push_back(other);
  };
  for (const auto& [landmarks, other] : shared) add(other);
  add(keyframe->parent);
  for (const auto child : keyframe->children) add(child);
  return result;
}

std::map<KeyframeId, double> MapReplica::path_lengths(KeyframeId from,
                                                      double max_m,
                                                      const Connections& loops) const {
  std::map<KeyframeId, std::vector<KeyframeId>> looped;
  for (const auto& [a, b] : loops) {
    looped[a].push_back(b);
    looped[b].push_back(a);
  }
  struct Reached {
    const Keyframe* keyframe = nullptr;
    double length_m = std::numeric_limits<double>::infinity();  ///< Shortest so far.
  };
  std::unordered_map<KeyframeId, Reached> reached;  // looked up only
  std::map<KeyframeId, double> lengths;
  using Open = std::pair<double, KeyframeId>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  const auto reach = [&](KeyframeId id, const Eigen::Vector3d& p_map, double length_m) {
    auto& node = reached[id];
    if (node.keyframe == nullptr) node.keyframe = find(id);
    if (node.keyframe == nullptr) return;
    length_m += (node.keyframe->T_map_camera.translation() - p_map).norm();
    if (length_m > max_m || !(length_m < node.length_m)) return;
    node.length_m = length_m;
    open.emplace(length_m, id);
  };
  if (const auto* start = find(from)) reach(from, start->T_map_camera.translation(), 0.0);
  while (!open.empty()) {
    const auto [length_m, id] = open.top();
    open.pop();
    if (length_m > reached.at(id).length_m) continue;  // a shorter way was found meanwhile
    lengths.emplace(id, length_m);
    const auto* keyframe = reached.at(id).keyframe;
    const Eigen::Vector3d& p_map = keyframe->T_map_camera.translation();
    reach(keyframe->parent, p_map, length_m);
    for (const auto child : keyframe->children) reach(child, p_map, length_m);
    for (const auto& [other, landmarks] : keyframe->shared_landmarks) {
      if (landmarks >= kMinShared) reach(other, p_map, length_m);
    }
    if (const auto found = looped.find(id); found != looped.end()) {
      for (const auto other : found->second) {
        const auto* end = find(other);
        if (end != nullptr) reach(other, end->T_map_camera.translation(), length_m);
      }
    }
  }
  return lengths;
}

SE3 MapReplica::relative_pose(KeyframeId from, KeyframeId to) const {
  return keyframes_.at(from).T_map_camera.inverse() * keyframes_.at(to).T_map_camera;
}

}  // namespace camvox::loop
