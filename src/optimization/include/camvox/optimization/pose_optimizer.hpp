#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"

namespace camvox::optimization {

/// A landmark of known position and the feature that is taken for it.
struct LandmarkMatch {
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  /// How uncertain p_world is: one standard deviation along the direction in which it is least
  /// known (its ray from the camera that made it).
  Eigen::Vector3d sigma_world = Eigen::Vector3d::Zero();
  PointObservation observation;
};

/// What the optimiser made of a match.
enum class MatchUse : std::uint8_t {
  kOutlier,        ///< The pixel disagrees.
  kPixel,          ///< The pixel agrees; there is no depth, or it disagrees.
  kPixelAndDepth,  ///< Both agree.
};

/// What is known of the pose beforehand, e.g. its rotation from a gyro.
struct PosePrior {
  geometry::SE3 T_world_camera;
  /// Of local(T_world_camera, estimate): inverse covariance, [rotation; translation].
  geometry::Matrix6d information = geometry::Matrix6d::Zero();
};

struct PoseOptimizerOptions {
  DepthModel depth_model = DepthModel::kMetric;
  int rounds = 4;             ///< Outliers are sorted out anew after each; the last has no kernel.
  int iterations = 10;        ///< Of Levenberg-Marquardt, at most, in each round.
  double gate_pixel = 5.991;  ///< chi^2 of two rows, 95 %.
  double gate_depth = 7.815;  ///< chi^2 of three rows, 95 %.
  int min_inliers = 10;       ///< Fewer are no estimate.
};

struct PoseEstimate {
  enum class Status : std::uint8_t {
    kOk,
    kTooFewMatches,  ///< Fewer than min_inliers given, or left.
    kDegenerate,     ///< They do not determine all six degrees of freedom.
  };

  Status status = Status::kTooFewMatches;
  geometry::SE3 T_world_camera;  ///< The start when the status is not kOk.
  /// Of local(true pose, T_world_camera), [rotation; translation]; scaled up when the residuals
  /// are larger than their sigmas say.
  geometry::Matrix6d covariance_camera = geometry::Matrix6d::Zero();
  std::vector<MatchUse> uses;  ///< One for each match.
  int inliers = 0;             ///< Matches whose use is not kOutlier.
  int inliers_with_depth = 0;
  int iterations = 0;
  double chi2_per_row = 0.0;  ///< Mean squared residual of the inliers in units of sigma.
};

/// The camera pose that explains the matches best: Levenberg-Marquardt with Huber's kernel in
/// rounds, after each of which all matches are judged anew with the chi^2 gates (Mur-Artal &
/// Tardos, "ORB-SLAM2", 2017, section III.B). What we changed: with DepthModel::kMetric a depth
/// that disagrees costs the match its depth row only; the landmark's own uncertainty widens the
/// sigmas of pixel and depth at the start pose. Same input, same bits out.
[[nodiscard]] PoseEstimate optimize_pose(const geometry::SE3& T_world_camera_start,
                                         std::span<const LandmarkMatch> matches,
                                         const PinholeCamera& camera,
                                         const PoseOptimizerOptions& options = {},
                                         const std::optional<PosePrior>& prior = std::nullopt);

}  // namespace camvox::optimization
