#include "camvox/mapping/map.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace camvox::mapping {
namespace {

/// How many removed ids are remembered, for messages that were under way.
constexpr std::size_t kRemembered = 20000;

[[noreturn]] void missing(const char* what, std::uint64_t id) {
  throw std::logic_error(std::string("map: no ") + what + " " + std::to_string(id));
}

auto observation_by(const MapLandmark& landmark, KeyframeId keyframe) {
  return std::lower_bound(
      landmark.observations.begin(),
      landmark.observations.end(),
      keyframe,
      [](const Observation& observation, KeyframeId id) { return observation.keyframe < id; });
}

template <typename Key, typename Value>
void keep_newest(std::map<Key, Value>& table) {
  while (table.size() > kRemembered) table.erase(table.begin());
}

}  // namespace

std::vector<LandmarkId> Map::landmark_ids() const {
  std::vector<LandmarkId> ids;
  ids.reserve(landmarks_.size());
  for (const auto& [id, landmark] : landmarks_) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<KeyframeId> Map::parents_first() const {
  std::vector<KeyframeId> order;
  order.reserve(keyframes_.size());
  if (!keyframes_.empty()) order.push_back(keyframes_.begin()->first);
  for (std::size_t i = 0; i < order.size(); ++i) {
    const auto& children = keyframe(order[i]).children;
    order.insert(order.end(), children.begin(), children.end());
  }
  return order;
}

const MapKeyframe* Map::find_keyframe(KeyframeId id) const {
  const auto found = keyframes_.find(id);
  return found == keyframes_.end() ? nullptr : &found->second;
}

const MapLandmark* Map::find_landmark(LandmarkId id) const {
  const auto found = landmarks_.find(id);
  return found == landmarks_.end() ? nullptr : &found->second;
}

const MapKeyframe& Map::keyframe(KeyframeId id) const {
  const auto* found = find_keyframe(id);
  if (found == nullptr) missing("keyframe", id);
  return *found;
}

const MapLandmark& Map::landmark(LandmarkId id) const {
  const auto* found = find_landmark(id);
  if (found == nullptr) missing("landmark", id);
  return *found;
}

MapKeyframe& Map::at(KeyframeId id) { return const_cast<MapKeyframe&>(keyframe(id)); }
MapLandmark& Map::landmark_at(LandmarkId id) { return const_cast<MapLandmark&>(landmark(id)); }

void Map::add_keyframe(tracking::Keyframe frame, KeyframeId parent) {
  const KeyframeId id = frame.id;
  if (id == 0 || keyframes_.contains(id)) {
    throw std::logic_error("map: keyframe id " + std::to_string(id) + " is 0 or taken");
  }
  if (!keyframes_.contains(parent)) parent = keyframes_.empty() ? 0 : keyframes_.begin()->first;
  frame.landmark_ids.assign(frame.features.size(), 0);
  MapKeyframe& added = keyframes_[id];
  added.grid = features::FeatureGrid(frame.features);
  added.frame = std::move(frame);
  added.parent = parent;
  if (parent != 0) at(parent).children.insert(id);
  removed_.erase(id);
}

void Map::hand_over_children(KeyframeId id) {
  MapKeyframe& leaving = at(id);
  std::set<KeyframeId> orphans = leaving.children;
  std::set<KeyframeId> adopters = {leaving.parent};
  // As Prim's algorithm does it: always the strongest tie between the tree and who is outside.
  while (!orphans.empty()) {
    KeyframeId best_child = *orphans.begin();
    KeyframeId best_parent = leaving.parent;
    int best_shared = -1;
    for (const auto child : orphans) {
      for (const auto adopter : adopters) {
        const auto& shared = keyframe(child).shared;
        const auto tie = shared.find(adopter);
        const int count = tie == shared.end() ? 0 : tie->second;
        if (count > best_shared) {
          best_shared = count;
          best_child = child;
          best_parent = adopter;
        }
      }
    }
    at(best_child).parent = best_parent;
    at(best_parent).children.insert(best_child);
    adopters.insert(best_child);
    orphans.erase(best_child);
  }
}

void Map::remove_keyframe(KeyframeId id) {
  const MapKeyframe& leaving = keyframe(id);
  if (leaving.parent == 0 && keyframes_.size() > 1) {
    throw std::logic_error("map: the root of the tree cannot be removed");
  }
  const auto landmark_ids = leaving.frame.landmark_ids;
  for (const auto landmark : landmark_ids) {
    if (landmark != 0) forget(landmark, id);
  }
  if (leaving.parent != 0) {
    hand_over_children(id);
    at(leaving.parent).children.erase(id);
    removed_[id] = {
        leaving.parent,
        keyframe(leaving.parent).frame.T_map_camera.inverse() * leaving.frame.T_map_camera};
    keep_newest(removed_);
  }
  keyframes_.erase(id);
}

void Map::set_pose(KeyframeId id, const geometry::SE3& T_map_camera) {
  at(id).frame.T_map_camera = T_map_camera;
}

bool Map::is_below(KeyframeId id, KeyframeId ancestor) const {
  while (id != 0 && id != ancestor) id = keyframe(id).parent;
  return id == ancestor;
}

void Map::set_parent(KeyframeId id, KeyframeId parent) {
  MapKeyframe& child = at(id);
  if (child.parent == 0 || is_below(parent, id)) {
    throw std::logic_error("map: keyframe " + std::to_string(id) + " cannot hang below " +
                           std::to_string(parent));
  }
  at(child.parent).children.erase(id);
  child.parent = parent;
  at(parent).children.insert(id);
}

void Map::add_landmark(tracking::Landmark landmark, const Observation& seen, KeyframeId born_at) {
  const LandmarkId id = landmark.id;
  if (id == 0 || landmarks_.contains(id)) {
    throw std::logic_error("map: landmark id " + std::to_string(id) + " is 0 or taken");
  }
  replaced_.erase(id);
  MapLandmark& added = landmarks_[id];
  added.landmark = landmark;
  added.born_at = born_at;
  if (!observe(id, seen)) {
    landmarks_.erase(id);
    throw std::logic_error("map: the feature of new landmark " + std::to_string(id) + " is taken");
  }
}

void Map::share(KeyframeId a, KeyframeId b, int change) {
  for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
    auto& shared = at(from).shared;
    if ((shared[to] += change) == 0) shared.erase(to);
  }
}

void Map::unlink(const MapLandmark& landmark) {
  const auto& seen = landmark.observations;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    at(seen[i].keyframe).frame.landmark_ids[seen[i].feature] = 0;
    for (std::size_t k = i + 1; k < seen.size(); ++k) share(seen[i].keyframe, seen[k].keyframe, -1);
  }
}

void Map::remove_landmark(LandmarkId id) {
  unlink(landmark(id));
  landmarks_.erase(id);
}

void Map::set_position(LandmarkId id, const Eigen::Vector3d& p_map) {
  landmark_at(id).landmark.p_map = p_map;
}

void Map::set_appearance(LandmarkId id, const tracking::Landmark& like) {
  auto& landmark = landmark_at(id).landmark;
  const Eigen::Vector3d p_map = landmark.p_map;
  landmark = like;
  landmark.id = id;
  landmark.p_map = p_map;
}

void Map::count_visible(LandmarkId id, bool found) {
  auto& landmark = landmark_at(id);
  ++landmark.visible;
  if (found) ++landmark.found;
}

void Map::set_counts(LandmarkId id, std::uint32_t visible, std::uint32_t found) {
  auto& landmark = landmark_at(id);
  landmark.visible = visible;
  landmark.found = found;
}

bool Map::observe(LandmarkId id, const Observation& seen) {
  MapLandmark& landmark = landmark_at(id);
  auto& slot = at(seen.keyframe).frame.landmark_ids.at(seen.feature);
  const auto place = observation_by(landmark, seen.keyframe);
  const bool seen_already =
      place != landmark.observations.end() && place->keyframe == seen.keyframe;
  if (slot != 0 || seen_already) return false;
  slot = id;
  for (const auto& other : landmark.observations) share(other.keyframe, seen.keyframe, 1);
  landmark.observations.insert(place, seen);
  return true;
}

void Map::forget(LandmarkId id, KeyframeId keyframe) {
  MapLandmark& landmark = landmark_at(id);
  const auto place = observation_by(landmark, keyframe);
  if (place == landmark.observations.end() || place->keyframe != keyframe) {
    missing("observation by keyframe", keyframe);
  }
  at(keyframe).frame.landmark_ids[place->feature] = 0;
  landmark.observations.erase(place);
  for (const auto& other : landmark.observations) share(other.keyframe, keyframe, -1);
  if (landmark.observations.empty()) landmarks_.erase(id);
}

void Map::fuse(LandmarkId loser, LandmarkId winner) {
  if (loser == winner) return;
  const MapLandmark leaving = landmark(loser);
  MapLandmark& staying = landmark_at(winner);
  staying.visible += leaving.visible;
  staying.found += leaving.found;
  remove_landmark(loser);
  for (const auto& seen : leaving.observations) observe(winner, seen);
  replaced_[loser] = winner;
  keep_newest(replaced_);
}

LandmarkId Map::resolve(LandmarkId id) const {
  for (auto next = replaced_.find(id); next != replaced_.end(); next = replaced_.find(id)) {
    id = next->second;
  }
  return landmarks_.contains(id) ? id : 0;
}

Map::Anchor Map::anchor(KeyframeId id) const {
  Anchor result{id, {}};
  while (!keyframes_.contains(result.keyframe)) {
    const auto next = removed_.find(result.keyframe);
    if (next == removed_.end()) return {};
    result.keyframe = next->second.keyframe;
    result.T_keyframe_removed = next->second.T_keyframe_removed * result.T_keyframe_removed;
  }
  return result;
}

std::vector<KeyframeId> Map::neighbours(KeyframeId id, std::size_t limit, int min_shared) const {
  std::vector<std::pair<int, KeyframeId>> ranked;
  for (const auto& [other, count] : keyframe(id).shared) ranked.emplace_back(-count, other);
  std::sort(ranked.begin(), ranked.end());
  std::vector<KeyframeId> ids;
  for (const auto& [negative_count, other] : ranked) {
    if (ids.size() >= limit || (-negative_count < min_shared && !ids.empty())) break;
    ids.push_back(other);
  }
  return ids;
}

std::size_t Map::memory_bytes() const {
  std::size_t bytes = 0;
  constexpr std::size_t kTreeNode = 48;  // three pointers, colour, key and value
  for (const auto& [id, keyframe] : keyframes_) {
    const std::size_t per_feature = sizeof(features::KeyPoint) + sizeof(Eigen::Vector2f) +
                                    sizeof(features::Descriptor) + 2 * sizeof(float) +
                                    sizeof(LandmarkId) + 12;  // 12: a grid entry
    bytes += sizeof(MapKeyframe) + 64 * 48 * sizeof(std::uint32_t) +
             keyframe.frame.features.size() * per_feature +
             kTreeNode * (keyframe.children.size() + keyframe.shared.size());
  }
  for (const auto& [id, landmark] : landmarks_) {
    bytes += sizeof(MapLandmark) + 3 * sizeof(void*) +
             landmark.observations.capacity() * sizeof(Observation);
  }
  return bytes + (kTreeNode + sizeof(Anchor)) * removed_.size() + kTreeNode * replaced_.size();
}

void Map::check_consistency() const {
  const auto demand = [](bool holds, const char* what) {
    if (!holds) throw std::logic_error(std::string("map is inconsistent: ") + what);
  };
  std::map<KeyframeId, std::map<KeyframeId, int>> shared;
  std::size_t observations = 0;
  for (const auto& [id, landmark] : landmarks_) {
    demand(!landmark.observations.empty(), "a landmark that nothing sees");
    for (const auto& seen : landmark.observations) {
      const auto* keyframe = find_keyframe(seen.keyframe);
      demand(keyframe != nullptr && seen.feature < keyframe->frame.landmark_ids.size() &&
                 keyframe->frame.landmark_ids[seen.feature] == id,
             "keyframe and landmark disagree");
      ++observations;
      for (const auto& other : landmark.observations) {
        if (other.keyframe != seen.keyframe) ++shared[seen.keyframe][other.keyframe];
      }
    }
  }
  for (const auto& [id, keyframe] : keyframes_) {
    const auto& ids = keyframe.frame.landmark_ids;
    observations -= ids.size() - static_cast<std::size_t>(std::count(ids.begin(), ids.end(), 0U));
    demand(keyframe.shared == shared[id], "covisibility");
    demand(ids.size() == keyframe.frame.features.size(), "one landmark id per feature");
    const bool root = id == keyframes_.begin()->first;
    demand((keyframe.parent == 0) == root, "the oldest keyframe, and no other, is the root");
    const auto* parent = find_keyframe(keyframe.parent);
    demand(root || (parent != nullptr && parent->children.contains(id)),
           "parent does not know its child");
    for (const auto child : keyframe.children) {
      const auto* there = find_keyframe(child);
      demand(there != nullptr && there->parent == id, "child does not know its parent");
    }
  }
  demand(parents_first().size() == keyframes_.size(), "keyframe outside of the tree");
  demand(observations == 0, "a keyframe sees a landmark that does not know it");
}

}  // namespace camvox::mapping
