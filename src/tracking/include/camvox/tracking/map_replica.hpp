#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "camvox/geometry/se3.hpp"
#include "camvox/tracking/keyframe.hpp"
#include "camvox/tracking/local_map.hpp"

namespace camvox::tracking {

/// Tracking's own copy of the map around the camera: the newest local map that mapping sent, and
/// on top of it the keyframes made since, with the landmarks that they founded. A landmark's
/// record (how often it disagreed with what was seen) stays with it from map to map.
class MapReplica {
 public:
  MapReplica(const optimization::PinholeCamera& camera, const ScaleLevels& scale)
      : camera_(camera), scale_(scale) {}

  /// Takes in a local map; own keyframes that it includes are dropped, later ones are moved
  /// along with the keyframe that they were taken from. Returns false, and changes nothing, for an
  /// empty map, for one older than the present one, and for one that knows fewer keyframes: mapping
  /// was restarted and has not caught up.
  bool apply(LocalMap map);
  /// Whether the map cannot have been made of what is here: it has keyframes that were never made
  /// here, or something else under the ids of those that were.
  [[nodiscard]] bool is_foreign(const LocalMap& map) const;
  /// Adds a keyframe just made, and the landmarks that it founded.
  void add(const Keyframe& keyframe);
  /// For a mapping that is away for long: with `most` pending keyframes, or four if that is more,
  /// one goes together with the landmarks that it founded. It is one of the older half, so that
  /// what is near the camera stays, and the one there that leaves the smallest gap, but not the
  /// first. What was taken from it is tied to its parent instead. Returns its id.
  std::optional<KeyframeId> thin_out(std::size_t most);
  void clear();
  /// Frames count from 1 again: the next map is not older than the present one.
  void forget_frame_id() { frame_id_ = 0; }

  /// By ascending id.
  [[nodiscard]] const std::vector<Landmark>& landmarks() const { return landmarks_; }
  [[nodiscard]] std::optional<std::size_t> find(LandmarkId id) const;
  [[nodiscard]] const std::vector<LocalMap::KeyframePose>& keyframes() const { return keyframes_; }
  [[nodiscard]] std::optional<geometry::SE3> T_map_keyframe(KeyframeId id) const;

  /// Notes whether what was seen agreed with the landmark. One that disagreed with most of its
  /// latest observations is banned: it moves, or its depth is wrong.
  void judge(std::size_t landmark, bool agreed);
  [[nodiscard]] bool is_banned(std::size_t landmark) const {
    return strikes_[landmark] >= kStrikesToBan;
  }
  [[nodiscard]] int banned_count() const;
  /// Another frame has gone by for those that are banned; after kBanFrames they may try again, and
  /// are banned anew if they still disagree.
  void age_bans();

  [[nodiscard]] std::uint64_t map_epoch() const { return map_epoch_; }
  [[nodiscard]] std::uint64_t frame_id() const { return frame_id_; }
  [[nodiscard]] KeyframeId next_keyframe_id() const { return next_keyframe_id_; }
  /// Own keyframes that mapping has not yet taken in.
  [[nodiscard]] std::size_t pending_count() const { return pending_.size(); }
  [[nodiscard]] bool empty() const { return keyframes_.empty(); }

 private:
  static constexpr std::uint8_t kStrikesToBan = 6;  ///< A disagreement is two, an agreement -1.
  static constexpr std::uint8_t kStrike = 2;
  static constexpr std::uint8_t kBanFrames = 20;

  struct Pending {
    LocalMap::KeyframePose keyframe;
    KeyframeId parent_id = 0;
    geometry::SE3 T_parent_camera;
    std::vector<Landmark> landmarks;
  };

  void append(const Pending& pending);
  void remove(KeyframeId id);
  [[nodiscard]] bool shows_other_landmarks(const LocalMap& map) const;
  void move_with_parent(Pending& pending) const;

  optimization::PinholeCamera camera_;
  ScaleLevels scale_;
  std::vector<LocalMap::KeyframePose> keyframes_;
  std::vector<Landmark> landmarks_;
  std::vector<std::uint8_t> strikes_;  ///< Of the landmark of the same index.
  std::vector<Pending> pending_;
  std::uint64_t map_epoch_ = 0;
  std::uint64_t frame_id_ = 0;
  KeyframeId next_keyframe_id_ = 1;
  KeyframeId next_pending_id_ = 0;  ///< Mapping has taken in all keyframes below.
};

}  // namespace camvox::tracking
