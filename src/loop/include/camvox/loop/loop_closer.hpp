#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/loop/consistency.hpp"
#include "camvox/loop/geometric_verification.hpp"
#include "camvox/loop/map_replica.hpp"
#include "camvox/loop/place_index.hpp"
#include "camvox/loop/surface_places.hpp"
#include "camvox/optimization/pose_graph.hpp"

namespace camvox::loop {

/// Tuning of LoopCloser. YAML keys are the field names.
struct LoopCloserConfig {
  double min_path_m = 10.0;       ///< A keyframe nearer along the path is no loop.
  double min_score_ratio = 0.12;  ///< Of the score to that of the best neighbour of the query.
  int max_places = 3;             ///< Verified for a keyframe.
  int max_places_lost = 6;        ///< Verified for a lost tracker.
  int views_per_place = 5;        ///< Keyframes whose features are searched.
  int consistent_queries = 3;     ///< Keyframes that must agree on a loop.
  int window_keyframes = 15;      ///< A measurement waits so long for others that agree.
  int correction_interval = 10;   ///< Keyframes between corrections, unless the map is far off.
  double urgent_sigma = 3.0;      ///< Far off: by so many times what neighbours are worth.
  int essential_landmarks = 100;  ///< Keyframes that share as many are tied in the pose graph.
  double same_pose_m = 0.5;       ///< Answers from two places farther apart contradict.
  double same_pose_deg = 5.0;     ///< The same, rotation.
  PlaceIndexConfig index;
  VerificationConfig verification;
  SurfacePlacesConfig surfaces;
  DriftConfig drift;
  optimization::PoseGraphConfig pose_graph;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_path_m", self.min_path_m, config::at_least(0.0));
    field("min_score_ratio", self.min_score_ratio, config::at_least(0.0), config::at_most(1.0));
    field("max_places", self.max_places, config::at_least(1), config::at_most(20));
    field("max_places_lost", self.max_places_lost, config::at_least(1), config::at_most(50));
    field("views_per_place", self.views_per_place, config::at_least(1), config::at_most(20));
    field("consistent_queries", self.consistent_queries, config::at_least(1), config::at_most(20));
    field("window_keyframes", self.window_keyframes, config::at_least(1), config::at_most(100));
    field("correction_interval", self.correction_interval, config::at_least(1));
    field("urgent_sigma", self.urgent_sigma, config::greater_than(0.0));
    field("essential_landmarks", self.essential_landmarks, config::at_least(15));
    field("same_pose_m", self.same_pose_m, config::greater_than(0.0));
    field("same_pose_deg", self.same_pose_deg, config::greater_than(0.0));
    field("index", self.index);
    field("verification", self.verification);
    field("surfaces", self.surfaces);
    field("drift", self.drift);
    field("pose_graph", self.pose_graph);
  }
};

/// Places that a frame may show, with all that is needed to verify them on another thread.
struct VerificationTask {
  struct Candidate {
    KeyframeId match_id = 0;
    double score = 0.0;
    std::vector<std::shared_ptr<const features::FrameFeatures>> features;  ///< By view.
    std::vector<geometry::SE3> T_match_camera;                             ///< By view.
    Eigen::Vector3d p_map_match = Eigen::Vector3d::Zero();                 ///< In today's map.
  };
  KeyframeId query_id = 0;  ///< 0: a lost tracker's frame.
  std::shared_ptr<const features::FrameFeatures> query;
  std::vector<Candidate> candidates;
  double same_place_m = 0.0;  ///< Candidates nearer to one that was confirmed are not verified.
  std::optional<SurfaceTask> surfaces;  ///< Compared when no candidate is confirmed.

  [[nodiscard]] bool empty() const { return candidates.empty() && !surfaces; }
};

struct VerifiedPlace {
  KeyframeId match_id = 0;
  double score = 0.0;
  Verification verification;
  bool by_surfaces = false;
};

/// A pose graph to solve on another thread, and what it is for.
struct CorrectionTask {
  std::uint64_t map_epoch = 0;  ///< That the poses belong to.
  LoopMeasurement loop;         ///< The one that gave rise to it.
  std::vector<KeyframeId> keyframe_ids;
  optimization::PoseGraph graph;
  std::vector<std::pair<KeyframeId, KeyframeId>> robust_edges;  ///< Query and match, in order.
  optimization::PoseGraphConfig config;
};

struct Correction {
  std::uint64_t map_epoch = 0;
  LoopMeasurement loop;
  /// None when there is no solution, or when every loop was rejected: then nothing is to be moved.
  std::vector<std::pair<KeyframeId, geometry::SE3>> T_map_camera;
  std::vector<std::pair<KeyframeId, KeyframeId>> rejected_loops;  ///< Query and match.
  optimization::PoseGraphSummary summary;
};

/// Where a lost tracker is.
struct Relocalisation {
  geometry::SE3 T_map_camera;
  geometry::Matrix6d covariance_camera = geometry::Matrix6d::Zero();
  int inliers = 0;
  std::vector<KeyframeId> keyframe_ids;  ///< The one that matched best, then its neighbours.
};

/// Counts of what happened to candidates, for diagnostics.
struct LoopStatistics {
  std::uint64_t places_verified = 0;
  std::uint64_t places_confirmed = 0;  ///< Passed the geometric layers.
  std::uint64_t implausible = 0;       ///< Too far from where the map can be wrong.
  std::uint64_t ambiguous = 0;         ///< Two different places fit.
  std::uint64_t surfaces_compared = 0;
  std::uint64_t surfaces_confirmed = 0;  ///< Distinct and certain.
  std::uint64_t surface_loops = 0;       ///< Of the loops.
  std::uint64_t loops = 0;               ///< Measurements accepted into the pose graph.
  std::uint64_t loops_left_out = 0;      ///< Taken out by the pose graph.
  std::uint64_t corrections = 0;
};

/// Finds out where the robot has been before. Works on its own copy of keyframes and poses, and
/// only proposes: a loop becomes real when the owner of the map applies the correction and says so
/// through update().
///
/// The work is cut so that a caller can move the heavy parts (verify, correct: functions of their
/// arguments) to another thread:
///
///     closer.insert(keyframe);
///     const auto places = verify(closer.detect(keyframe.id), camera, config);
///     if (const auto task = closer.consider(keyframe.id, places)) {
///       closer.finish(correct(*task));
///     }
///
/// One false loop must not bend the map. The layers: appearance relative to the query's
/// neighbours; geometric verification; plausibility against the drift along the path; no two
/// different places may fit; several keyframes must agree pairwise (maximum clique); a robust
/// kernel and rejection in the pose graph. Where a place was passed in another direction, images
/// show nothing in common: there the surfaces around it stand in for appearance and geometric
/// verification. Deterministic; not thread-safe.
class LoopCloser {
 public:
  /// Throws config::ConfigError.
  explicit LoopCloser(const LoopCloserConfig& config);

  /// Takes a keyframe in. Its pose must be of the current epoch.
  void insert(const tracking::Keyframe& keyframe);
  /// What the owner of the map has changed; removed keyframes are forgotten.
  void update(const MapChange& change);

  /// The places that a keyframe that was taken in may show again.
  [[nodiscard]] VerificationTask detect(KeyframeId id) const;
  /// The places that a frame may show, wherever it is.
  [[nodiscard]] VerificationTask detect_lost(
      std::shared_ptr<const features::FrameFeatures> frame) const;

  /// Takes verified places of a keyframe into account; a task when the map shall be corrected.
  [[nodiscard]] std::optional<CorrectionTask> consider(KeyframeId id,
                                                       const std::vector<VerifiedPlace>& places);
  /// Takes the outcome of a task into account: loops that the graph rejects are forgotten.
  void finish(const Correction& correction);

  /// The pose of a lost tracker; nothing when it is not known beyond doubt.
  [[nodiscard]] std::optional<Relocalisation> relocalise(
      const std::vector<VerifiedPlace>& places) const;

  [[nodiscard]] const MapReplica& map() const { return map_; }
  [[nodiscard]] const PlaceIndex& index() const { return index_; }
  [[nodiscard]] const std::deque<LoopMeasurement>& loops() const { return loops_; }
  [[nodiscard]] const LoopStatistics& statistics() const { return statistics_; }
  [[nodiscard]] const LoopCloserConfig& config() const { return config_; }

 private:
  [[nodiscard]] std::vector<VerificationTask::Candidate> best_places(
      const std::vector<PlaceScore>& scores, std::size_t count) const;
  [[nodiscard]] VerificationTask::Candidate candidate(const PlaceScore& score) const;
  [[nodiscard]] MapReplica::Connections loop_connections() const;
  [[nodiscard]] std::vector<LoopMeasurement> plausible_measurements(
      KeyframeId id, const std::vector<VerifiedPlace>& places);
  [[nodiscard]] std::vector<LoopMeasurement> agreeing(const LoopMeasurement& newest) const;
  [[nodiscard]] double path_length_m(KeyframeId from, KeyframeId to) const;
  [[nodiscard]] bool agree(const LoopMeasurement& a, const LoopMeasurement& b) const;
  void accept(const std::vector<LoopMeasurement>& set);
  [[nodiscard]] bool says_something_new(const LoopMeasurement& loop) const;
  [[nodiscard]] bool due(const LoopMeasurement& newest) const;
  void forget_old(KeyframeId newest);
  [[nodiscard]] CorrectionTask correction_task(const LoopMeasurement& newest) const;

  LoopCloserConfig config_;
  MapReplica map_;
  PlaceIndex index_;
  std::deque<LoopMeasurement> pending_;  ///< Confirmed each by itself, by age.
  std::deque<LoopMeasurement> loops_;    ///< Accepted, by age.
  std::deque<KeyframeId> recent_;        ///< Keyframes taken in last.
  /// Of consider(): lengths of paths from a keyframe, computed once for all pairs of loops.
  using Paths = std::map<KeyframeId, std::map<KeyframeId, double>>;
  mutable Paths near_paths_m_;
  mutable Paths far_paths_m_;  ///< To all of the map.
  int keyframes_since_correction_ = 0;
  LoopStatistics statistics_;
};

/// Verifies the candidates of a task, less those that are beside one that was confirmed and could
/// only say the same; those that fail are included with their status.
[[nodiscard]] std::vector<VerifiedPlace> verify(const VerificationTask& task,
                                                const optimization::PinholeCamera& camera,
                                                const LoopCloserConfig& config);

/// Solves the pose graph of a task.
[[nodiscard]] Correction correct(const CorrectionTask& task);

}  // namespace camvox::loop
