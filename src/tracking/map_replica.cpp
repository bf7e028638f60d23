#include "camvox/tracking/map_replica.hpp"

#include <algorithm>
#include <utility>

#include "camvox/features/hamming.hpp"
#include "camvox/features/match.hpp"

namespace camvox::tracking {

bool MapReplica::apply(LocalMap map) {
  const bool older = map.map_epoch < map_epoch_ || map.frame_id < frame_id_ ||
                     map.next_keyframe_id < next_pending_id_;
  if (map.keyframes.empty() || older) return false;

  std::vector<std::uint8_t> strikes(map.landmarks.size(), 0);
  std::size_t old = 0;
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    while (old < landmarks_.size() && landmarks_[old].id < map.landmarks[i].id) ++old;
    if (old == landmarks_.size()) break;
    if (landmarks_[old].id == map.landmarks[i].id) strikes[i] = strikes_[old];
  }
  landmarks_ = std::move(map.landmarks);
  strikes_ = std::move(strikes);
  keyframes_ = std::move(map.keyframes);
  map_epoch_ = map.map_epoch;
  frame_id_ = map.frame_id;
  next_keyframe_id_ = std::max(next_keyframe_id_, map.next_keyframe_id);
  next_pending_id_ = map.next_keyframe_id;

  std::erase_if(pending_, [&](const Pending& own) { return own.keyframe.id < next_pending_id_; });
  for (auto& own : pending_) {
    move_with_parent(own);
    append(own);
  }
  return true;
}

bool MapReplica::is_foreign(const LocalMap& map) const {
  if (empty() || map.keyframes.empty()) return false;
  return map.keyframes.back().id >= next_keyframe_id_ || shows_other_landmarks(map);
}

// Mapping leaves a landmark's looks as they were founded, or takes another view's of the same
// point. Under the id of another map's landmark is another point.
bool MapReplica::shows_other_landmarks(const LocalMap& map) const {
  int alike = 0, others = 0;
  auto theirs = map.landmarks.begin();
  for (const auto& pending : pending_) {
    for (const auto& own : pending.landmarks) {
      while (theirs != map.landmarks.end() && theirs->id < own.id) ++theirs;
      if (theirs == map.landmarks.end()) return others > alike;
      if (theirs->id != own.id) continue;
      const int distance = features::hamming_distance(theirs->descriptor, own.descriptor);
      ++(distance <= features::kPermissiveDistance ? alike : others);
    }
  }
  return others > alike;
}

void MapReplica::move_with_parent(Pending& pending) const {
  const auto T_map_parent = T_map_keyframe(pending.parent_id);
  if (!T_map_parent) return;
  const geometry::SE3 T_map_camera = *T_map_parent * pending.T_parent_camera;
  const geometry::SE3 T_new_old = T_map_camera * pending.keyframe.T_map_camera.inverse();
  for (auto& landmark : pending.landmarks) {
    landmark.p_map = T_new_old * landmark.p_map;
    landmark.f_map = (T_new_old.rotation() * landmark.f_map.cast<double>()).cast<float>();
  }
  pending.keyframe.T_map_camera = T_map_camera;
}

void MapReplica::append(const Pending& pending) {
  keyframes_.push_back(pending.keyframe);
  landmarks_.insert(landmarks_.end(), pending.landmarks.begin(), pending.landmarks.end());
  strikes_.resize(landmarks_.size(), 0);
}

void MapReplica::add(const Keyframe& keyframe) {
  Pending own;
  own.keyframe = {keyframe.id, keyframe.T_map_camera};
  own.parent_id = keyframe.parent_id;
  own.T_parent_camera = keyframe.T_parent_camera;
  for (std::size_t i = 0; i < keyframe.landmark_ids.size(); ++i) {
    if (keyframe.landmark_ids[i] != landmark_id(keyframe.id, i)) continue;
    if (auto landmark = landmark_from_depth(keyframe, i, camera_, scale_)) {
      own.landmarks.push_back(*landmark);
    }
  }
  append(own);
  pending_.push_back(std::move(own));
  next_keyframe_id_ = std::max(next_keyframe_id_, keyframe.id + 1);
}

std::optional<KeyframeId> MapReplica::thin_out(std::size_t most) {
  constexpr std::size_t kFewest = 4;
  if (pending_.size() < std::max(most, kFewest)) return std::nullopt;
  const auto gap = [this](std::size_t i) {
    return pending_[i + 1].keyframe.id - pending_[i - 1].keyframe.id;
  };
  std::size_t index = 1;  // never the oldest: it sees what mapping has
  for (std::size_t i = 2; i < pending_.size() / 2; ++i) {
    if (gap(i) < gap(index)) index = i;
  }
  const Pending gone = std::move(pending_[index]);
  pending_.erase(pending_.begin() + static_cast<std::ptrdiff_t>(index));
  for (auto& own : pending_) {
    if (own.parent_id == gone.keyframe.id) tie_to_parent_of(gone, own);
  }
  remove(gone.keyframe.id);
  return gone.keyframe.id;
}

void MapReplica::remove(KeyframeId id) {
  std::erase_if(keyframes_, [id](const auto& keyframe) { return keyframe.id == id; });
  const auto founded_before = [this](KeyframeId keyframe) {
    return std::partition_point(landmarks_.begin(), landmarks_.end(), [keyframe](const auto& own) {
      return founding_keyframe(own.id) < keyframe;
    });
  };
  const auto begin = founded_before(id);
  const auto end = founded_before(id + 1);
  const auto first = strikes_.begin() + (begin - landmarks_.begin());
  strikes_.erase(first, first + (end - begin));
  landmarks_.erase(begin, end);
}

void MapReplica::clear() { *this = MapReplica(camera_, scale_); }

std::optional<std::size_t> MapReplica::find(LandmarkId id) const {
  const auto found = std::lower_bound(
      landmarks_.begin(), landmarks_.end(), id, [](const Landmark& landmark, LandmarkId wanted) {
        return landmark.id < wanted;
      });
  if (found == landmarks_.end() || found->id != id) return std::nullopt;
  return static_cast<std::size_t>(found - landmarks_.begin());
}

std::optional<geometry::SE3> MapReplica::T_map_keyframe(KeyframeId id) const {
  const auto found = std::find_if(keyframes_.begin(), keyframes_.end(), [id](const auto& keyframe) {
    return keyframe.id == id;
  });
  if (found == keyframes_.end()) return std::nullopt;
  return found->T_map_camera;
}

void MapReplica::judge(std::size_t landmark, bool agreed) {
  std::uint8_t& strikes = strikes_[landmark];
  if (agreed) {
    strikes = static_cast<std::uint8_t>(strikes > 0 ? strikes - 1 : 0);
  } else {
    strikes = static_cast<std::uint8_t>(strikes + kStrike);
    if (strikes >= kStrikesToBan) strikes = kStrikesToBan + kBanFrames - 1;
  }
}

void MapReplica::age_bans() {
  for (auto& strikes : strikes_) {
    if (strikes >= kStrikesToBan) --strikes;
  }
}

int MapReplica::banned_count() const {
  return static_cast<int>(std::count_if(
      strikes_.begin(), strikes_.end(), [](auto strikes) { return strikes >= kStrikesToBan; }));
}

}  // namespace camvox::tracking
