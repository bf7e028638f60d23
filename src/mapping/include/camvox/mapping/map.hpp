#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "camvox/features/feature_grid.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/tracking/keyframe.hpp"
#include "camvox/tracking/local_map.hpp"

namespace camvox::mapping {

using tracking::KeyframeId;
using tracking::LandmarkId;

/// A landmark is feature `feature` of keyframe `keyframe`.
struct Observation {
  KeyframeId keyframe = 0;
  std::uint32_t feature = 0;

  bool operator==(const Observation&) const = default;
};

/// A keyframe in the map. `frame` has its present pose and what its features show at present.
struct MapKeyframe {
  tracking::Keyframe frame;
  features::FeatureGrid grid;
  KeyframeId parent = 0;  ///< In the spanning tree; 0: the root.
  std::set<KeyframeId> children;
  std::map<KeyframeId, int> shared;  ///< Number of landmarks that another keyframe sees, too.
};

/// A landmark in the map.
struct MapLandmark {
  tracking::Landmark landmark;
  std::vector<Observation> observations;  ///< Keyframe ids ascend; never empty outside of Map.
  KeyframeId born_at = 0;                 ///< The newest keyframe when it was made.
  std::uint32_t visible = 1;              ///< Keyframes that it should be seen in.
  std::uint32_t found = 1;                ///< Keyframes that it was seen in.

  /// The keyframe that it moves with.
  [[nodiscard]] KeyframeId reference() const { return observations.front().keyframe; }
};

/// Keyframes, landmarks, who sees what, covisibility and spanning tree, kept consistent with each
/// other. Knows no camera and judges nothing. What refers to ids that are not there throws
/// std::logic_error, unless said otherwise. Keyframes are iterated in order of their ids.
class Map {
 public:
  [[nodiscard]] const std::map<KeyframeId, MapKeyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] std::size_t landmark_count() const { return landmarks_.size(); }
  /// All ids, ascending.
  [[nodiscard]] std::vector<LandmarkId> landmark_ids() const;

  /// All keyframe ids, none before its parent in the spanning tree.
  [[nodiscard]] std::vector<KeyframeId> parents_first() const;

  [[nodiscard]] const MapKeyframe* find_keyframe(KeyframeId id) const;
  [[nodiscard]] const MapLandmark* find_landmark(LandmarkId id) const;
  [[nodiscard]] const MapKeyframe& keyframe(KeyframeId id) const;
  [[nodiscard]] const MapLandmark& landmark(LandmarkId id) const;

  /// Adds a keyframe that sees nothing yet, as a child of `parent` (0 or not there: of the oldest
  /// keyframe).
  void add_keyframe(tracking::Keyframe frame, KeyframeId parent);
  /// Its children go to the neighbour, within the tree, that they share most with. Landmarks that
  /// nothing else sees go, too. The last keyframe can be removed, the root while others are there
  /// not.
  void remove_keyframe(KeyframeId id);
  void set_pose(KeyframeId id, const geometry::SE3& T_map_camera);
  void set_parent(KeyframeId id, KeyframeId parent);

  /// Adds a landmark with its first observation.
  void add_landmark(tracking::Landmark landmark, const Observation& seen, KeyframeId born_at);
  void remove_landmark(LandmarkId id);
  void set_position(LandmarkId id, const Eigen::Vector3d& p_map);
  void set_appearance(LandmarkId id, const tracking::Landmark& like);
  void count_visible(LandmarkId id, bool found);
  void set_counts(LandmarkId id, std::uint32_t visible, std::uint32_t found);

  /// Notes that the landmark is seen. False, and nothing is changed, when the keyframe sees it
  /// already or the feature shows another one.
  bool observe(LandmarkId id, const Observation& seen);
  /// Takes an observation back; with its last one the landmark goes.
  void forget(LandmarkId id, KeyframeId keyframe);
  /// `loser` becomes `winner`: its observations and counts go over, its id stays known to
  /// resolve().
  void fuse(LandmarkId loser, LandmarkId winner);

  /// The landmark that an id stands for now; 0 when it is gone.
  [[nodiscard]] LandmarkId resolve(LandmarkId id) const;
  /// Where a removed keyframe would be now: its heir in the tree, and its pose relative to it. Also
  /// for keyframes that are there. Id 0 when it was never there, or too long ago.
  struct Anchor {
    KeyframeId keyframe = 0;
    geometry::SE3 T_keyframe_removed;
  };
  [[nodiscard]] Anchor anchor(KeyframeId id) const;

  /// Keyframes that share landmarks with this one, most first, then older first; at most `limit`,
  /// those with at least `min_shared` (or only the best when none reaches that).
  [[nodiscard]] std::vector<KeyframeId> neighbours(KeyframeId id,
                                                   std::size_t limit,
                                                   int min_shared = 15) const;

  /// Bytes that keyframes and landmarks take, as far as it can be counted.
  [[nodiscard]] std::size_t memory_bytes() const;
  /// Throws std::logic_error when two parts contradict each other. For tests and after loading.
  void check_consistency() const;

 private:
  [[nodiscard]] MapKeyframe& at(KeyframeId id);
  [[nodiscard]] MapLandmark& landmark_at(LandmarkId id);
  void share(KeyframeId a, KeyframeId b, int change);
  void unlink(const MapLandmark& landmark);
  void hand_over_children(KeyframeId id);
  [[nodiscard]] bool is_below(KeyframeId id, KeyframeId ancestor) const;

  std::map<KeyframeId, MapKeyframe> keyframes_;
  std::unordered_map<LandmarkId, MapLandmark>
      landmarks_;  ///< Looked up, never iterated for a result.
  std::map<LandmarkId, LandmarkId> replaced_;
  std::map<KeyframeId, Anchor> removed_;
};

}  // namespace camvox::mapping
