#pragma once

#include <set>
#include <vector>

#include "camvox/mapping/map.hpp"
#include "camvox/mapping/observation_model.hpp"
#include "camvox/optimization/bundle_adjustment.hpp"

namespace camvox::mapping {

/// A bundle adjustment cut out of the map. It can be solved on another thread while the map goes
/// on; what it found is brought back by ids.
struct BundleJob {
  optimization::BundleProblem problem;
  optimization::BundleAdjustmentConfig config;
  std::vector<KeyframeId> keyframes;   ///< Of problem.poses.
  std::vector<LandmarkId> landmarks;   ///< Of problem.points_world.
  std::vector<Observation> sightings;  ///< Of problem.observations.
  KeyframeId newest = 0;               ///< Later keyframes move along with their parents.
  std::uint64_t map_epoch = 0;         ///< A job from before a correction is not applied.
  std::uint64_t full_jobs = 0;         ///< Nor is a local one from before a full one.
  bool whole_map = false;
  bool keeps_outliers = false;  ///< What does not fit is not forgotten.

  [[nodiscard]] bool empty() const { return problem.observations.empty(); }
  /// Solves it; `stop` ends it after any iteration.
  optimization::BundleSummary solve(const std::atomic<bool>* stop = nullptr) {
    return optimization::adjust(problem, config, stop);
  }
};

/// The surroundings of keyframe `id`: it and its neighbours move, with all that they see (landmarks
/// seen twice at least, bounded by the config); others that see the same hold them in place.
[[nodiscard]] BundleJob make_local_job(const Map& map,
                                       const ObservationModel& model,
                                       KeyframeId id);
/// Everything; the root holds it in place, and `held` (as far as they are in the map) stay.
[[nodiscard]] BundleJob make_full_job(const Map& map,
                                      const ObservationModel& model,
                                      const std::set<KeyframeId>& held = {});

/// Writes a solved job into the map: poses, positions, and outliers out. What is gone from the map
/// since is passed over; of the whole map, what was moved since is put where the job has it.
/// Returns the keyframes that moved.
std::set<KeyframeId> apply_job(Map& map, const ObservationModel& model, const BundleJob& job);

}  // namespace camvox::mapping
