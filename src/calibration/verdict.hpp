#pragma once

#include <optional>
#include <stop_token>
#include <string>

#include "alignment.hpp"
#include "camvox/calibration/calibrator.hpp"

namespace camvox::calibration {

/// What the verdict looks at beside the result.
struct Contest {
  geometry::SE3 guess;                 ///< The extrinsics in force.
  std::optional<geometry::SE3> rival;  ///< The best of the other places that edges fit to.
  Prior prior;
  Stage stage;           ///< The last one, that gave the result.
  std::stop_token stop;  ///< Ends the examination with whatever numbers there are.
};

/// Covariance (right perturbation) of a pose from Alignment::refine: the sandwich of an
/// M-estimator, A^-1 B A^-1, with A the slope of the sum that the refinement brings to zero, and B
/// the spread of that sum from tile to tile, in which errors that many edges share count in full.
/// Source: Huber 1967; with clusters, Liang & Zeger, Biometrika 1986.
[[nodiscard]] geometry::Matrix6d covariance_of(const Alignment& alignment,
                                               const Fit& fit,
                                               const Stage& stage,
                                               const Prior& prior);

/// Fills in the numbers by which a result is judged, from its T_camera_lidar.
void examine(const Alignment& alignment, const Contest& contest, CalibrationResult& result);

/// Why an examined result must not be used, or "".
[[nodiscard]] std::string objection(const CalibrationResult& result, const GateConfig& gate);

}  // namespace camvox::calibration
