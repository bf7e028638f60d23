#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "camvox/mapping/bundle_job.hpp"
#include "camvox/mapping/keyframes.hpp"
#include "camvox/mapping/map.hpp"
#include "camvox/mapping/observation_model.hpp"

namespace camvox::mapping {

/// What changed in the map since the last time it was asked for.
struct MapChanges {
  std::vector<tracking::LocalMap::KeyframePose> keyframes;  ///< New or moved, by id.
  std::vector<KeyframeId> removed;                          ///< By id.
  struct Edge {
    KeyframeId a = 0;  ///< The smaller id.
    KeyframeId b = 0;
    int shared = 0;  ///< Landmarks that both see, now.
  };
  std::vector<Edge> edges;

  [[nodiscard]] bool empty() const { return keyframes.empty() && removed.empty() && edges.empty(); }
};

/// What loop closing proposes.
struct LoopProposal {
  std::uint64_t map_epoch = 0;  ///< The epoch that it looked at.
  KeyframeId query = 0;
  KeyframeId match = 0;
  KeyframePoses poses;       ///< Corrected, of the keyframes that it knew.
  bool by_surfaces = false;  ///< Query and match look elsewhere, they share no landmarks.
};

/// What became of a keyframe.
struct InsertReport {
  bool inserted = false;  ///< False: not new, or its lists do not fit together; see `problem`.
  std::string problem;
  std::size_t observed = 0;      ///< Known landmarks seen.
  std::size_t from_depth = 0;    ///< Landmarks founded with depth.
  std::size_t triangulated = 0;  ///< Landmarks founded together with neighbours.
  std::size_t culled = 0;        ///< Young landmarks dropped.
  std::size_t fused = 0;         ///< Observations added and landmarks fused.
};

/// Owns the map and does to it all that mapping does, one call at a time and without a thread:
///
///     if (mapper.insert(keyframe).inserted) {
///       auto job = mapper.local_job(keyframe.id);  // solve() may run elsewhere meanwhile
///       job.solve();
///       mapper.finish(job);
///       mapper.cull_keyframes(keyframe.id);
///     }
///
/// Method: local mapping of ORB-SLAM2 (Mur-Artal & Tardos, T-RO 2017), with the depth's own sigma
/// in place of a virtual stereo camera wherever two ways to know a point are weighed. Same calls,
/// same map, to the bit.
class Mapper {
 public:
  Mapper(const MappingConfig& config, const tracking::TrackingCamera& camera);

  /// Takes in a keyframe and its landmarks, drops bad young ones, triangulates new ones, and fuses
  /// duplicates with its neighbours. Its pose is taken relative to its parent, so that it fits a
  /// map that changed meanwhile.
  InsertReport insert(const tracking::Keyframe& keyframe);

  /// All of the above for one keyframe; what tests and offline runs call.
  InsertReport process(const tracking::Keyframe& keyframe);

  [[nodiscard]] BundleJob local_job(KeyframeId id) const;
  [[nodiscard]] BundleJob full_job() const;
  /// Brings in a solved job; false when a correction has made it void, or a full job that was
  /// brought in while it was solved. A full job may be solved beside local ones: keyframes that
  /// came since go with their parents.
  bool finish(const BundleJob& job);

  /// Drops redundant neighbours of a keyframe, but not the tracker's reference, nor the newest
  /// three.
  std::size_t cull_keyframes(KeyframeId id);
  /// The keyframe that tracking refers to at present.
  void set_reference(KeyframeId id) { tracker_reference_ = id; }

  /// Moves the corrected keyframes, those that came since with their parents, and landmarks with
  /// their keyframes; fuses what is double around the loop; raises the epoch. After a loop by
  /// surfaces no landmarks tie its ends: full jobs leave these where the correction put them.
  /// Returns what is wrong with the proposal, and then changes nothing; or "".
  std::string correct(const LoopProposal& proposal);

  [[nodiscard]] tracking::LocalMap local_map(std::uint64_t frame_id, KeyframeId reference) const;

  /// Poses, removals and covisibility changed since the last call.
  [[nodiscard]] MapChanges take_changes();
  /// Everything, as a newcomer needs it.
  [[nodiscard]] MapChanges all_changes() const;

  [[nodiscard]] const Map& map() const { return map_; }
  [[nodiscard]] std::uint64_t epoch() const { return epoch_; }
  [[nodiscard]] const ObservationModel& model() const { return model_; }

  /// For a mapper that was restarted: the others have seen corrections that it has not, and take
  /// nothing of an earlier epoch. The map stays.
  void raise_epoch(std::uint64_t epoch) { epoch_ = std::max(epoch_, epoch); }

  /// Keyframes that loops by surfaces have put where they are.
  [[nodiscard]] std::set<KeyframeId> loop_ends() const;

  /// Takes over a map that was loaded.
  void restore(Map map, std::uint64_t epoch, std::set<KeyframeId> loop_ends);

 private:
  [[nodiscard]] std::string problem_with(const tracking::Keyframe& keyframe) const;
  void attach_landmarks(const tracking::Keyframe& keyframe, InsertReport& report);
  void choose_parent(KeyframeId id);
  void fuse_across(KeyframeId query, KeyframeId match);
  void note_edges_of(KeyframeId id);
  [[nodiscard]] int shared_count(KeyframeId a, KeyframeId b) const;

  ObservationModel model_;
  Map map_;
  std::uint64_t epoch_ = 0;
  std::uint64_t full_jobs_ = 0;  ///< Brought in.
  KeyframeId tracker_reference_ = 0;
  std::set<KeyframeId> loop_ends_;  ///< Of loops by surfaces; some may have been culled since.
  std::set<KeyframeId> changed_;
  std::set<KeyframeId> removed_;
  std::set<std::pair<KeyframeId, KeyframeId>> changed_edges_;
};

}  // namespace camvox::mapping
