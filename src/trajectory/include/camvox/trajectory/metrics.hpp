#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camvox/trajectory/trajectory.hpp"

namespace camvox::trajectory {

/// Figures of a list of errors, with evo's names: std is that of the population, sse the sum of
/// squares.
struct Statistics {
  std::size_t count = 0;
  double max = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double min = 0.0;
  double rmse = 0.0;
  double sse = 0.0;
  double std = 0.0;
};

/// All zero for no errors.
[[nodiscard]] Statistics statistics(std::vector<double> errors);

/// Absolute pose error of each pair: distance between the positions.
[[nodiscard]] std::vector<double> absolute_errors_m(const std::vector<PosePair>& pairs);

/// The rotation's part of the same.
[[nodiscard]] std::vector<double> absolute_errors_rad(const std::vector<PosePair>& pairs);

/// Relative pose error: how far the estimated motion between two moments is from the real one.
struct RelativeError {
  std::size_t from = 0;  ///< Index of the earlier pair.
  std::size_t to = 0;
  double length_m = 0.0;  ///< Path of the reference in between.
  double translation_m = 0.0;
  double rotation_rad = 0.0;
};

/// Errors over consecutive stretches (each begins where the one before ends) that are at least
/// `delta_m` of the estimated path long, as evo's "--delta d --delta_unit m" takes them: what comes
/// before the path has first grown by that much is left out.
[[nodiscard]] std::vector<RelativeError> relative_errors_by_path(const std::vector<PosePair>& pairs,
                                                                 double delta_m);

/// The same over consecutive stretches of `frames` poses.
[[nodiscard]] std::vector<RelativeError> relative_errors_by_frames(
    const std::vector<PosePair>& pairs, std::size_t frames);

/// What counts as passing the same place again, in the reference.
struct RevisitRule {
  double max_distance_m = 2.0;
  double max_turn_rad = 0.5;   ///< More is a crossing, or the other direction.
  double min_travel_m = 20.0;  ///< In between; less is just going slowly.
};

/// Errors between each pose and the nearest of those that passed the same place before: near zero
/// where a loop was closed, as large as the drift where it was not. Quadratic in the poses.
[[nodiscard]] std::vector<RelativeError> revisit_errors(const std::vector<PosePair>& pairs,
                                                        const RevisitRule& rule = {});

/// KITTI odometry's measure: mean relative errors over all stretches of 100, 200, ... 800 m that
/// begin at every tenth frame (Geiger et al., CVPR 2012).
struct KittiErrors {
  double t_rel_percent = 0.0;
  double r_rel_deg_per_100m = 0.0;
  std::size_t stretches = 0;
};

/// Nothing when the path is shorter than the shortest stretch.
[[nodiscard]] std::optional<KittiErrors> kitti_errors(const std::vector<PosePair>& pairs,
                                                      const std::vector<double>& lengths_m = {
                                                          100, 200, 300, 400, 500, 600, 700, 800});

}  // namespace camvox::trajectory
