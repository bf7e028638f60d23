#include "camvox/tracking/health.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace camvox::tracking {
namespace {

constexpr double kNewWeight = 0.05;     ///< Of a frame in the averages.
constexpr int kFramesNeeded = 20;       ///< Before the averages say anything.
constexpr double kMaxChi2PerRow = 1.5;  ///< Good ones have 0.3 to 1.
constexpr double kMinInlierShare = 0.5;
constexpr double kMinDepthShare = 0.4;  ///< Of what features with depth let expect.

constexpr double kFading = 0.99;          ///< A frame, of the sums over turns.
constexpr double kStill_rad = 1e-3;       ///< Between two frames: noise.
constexpr double kLeastTurn_rad2 = 0.01;  ///< Sum of squares before they say anything.
constexpr double kMaxTurnExcess = 0.03;   ///< Good ones differ by less than 1 %.
constexpr double kTurnExcessSigmas = 2.0;

void average(double& mean, double value) { mean += kNewWeight * (value - mean); }

}  // namespace

void HealthMonitor::add(const FrameResult& result,
                        const std::optional<geometry::SO3>& R_previous_camera) {
  const auto& s = result.statistics;
  if (result.has_pose() && s.matches > 0 && s.inliers > 0 && s.features > 0) {
    frames_ = std::min(frames_ + 1, kFramesNeeded);
    average(chi2_per_row_, s.chi2_per_row);
    average(inlier_share_, static_cast<double>(s.inliers) / s.matches);
    average(depth_share_, static_cast<double>(s.inliers_with_depth) / s.inliers);
    average(depth_possible_, static_cast<double>(s.features_with_depth) / s.features);
  }
  compare_turns(result, R_previous_camera);
  judge(result);
}

void HealthMonitor::compare_turns(const FrameResult& result,
                                  const std::optional<geometry::SO3>& gyro) {
  const auto before = R_odom_camera_;
  R_odom_camera_.reset();
  if (!result.has_pose()) return;
  R_odom_camera_ = result.T_odom_camera.rotation();
  if (!before || !gyro) return;
  const Eigen::Vector3d by_camera = (before->inverse() * *R_odom_camera_).log();
  const Eigen::Vector3d by_gyro = gyro->log();
  if (by_gyro.norm() < kStill_rad) return;
  const double along_rad = by_gyro.normalized().dot(by_camera);  // the rest says nothing of scale
  turns_.gyro_gyro = kFading * turns_.gyro_gyro + by_gyro.squaredNorm();
  turns_.gyro_camera = kFading * turns_.gyro_camera + by_gyro.norm() * along_rad;
  turns_.camera_camera = kFading * turns_.camera_camera + along_rad * along_rad;
  turns_.count = kFading * turns_.count + 1.0;
}

double HealthMonitor::turn_excess() const {
  if (turns_.gyro_gyro < kLeastTurn_rad2) return 0.0;
  const double slope = turns_.gyro_camera / turns_.gyro_gyro;
  const double unexplained = std::max(0.0, turns_.camera_camera - slope * turns_.gyro_camera);
  const double sigma = std::sqrt(unexplained / turns_.count / turns_.gyro_gyro);
  const double excess = slope - 1.0;
  return std::abs(excess) > kMaxTurnExcess + kTurnExcessSigmas * sigma ? excess : 0.0;
}

void HealthMonitor::judge(const FrameResult& result) {
  if (result.state == TrackingState::kWaiting) {
    status_ = {Health::kWarn, "waiting for a frame with enough depth to start a map"};
  } else if (!result.has_pose()) {
    status_ = {Health::kError,
               result.statistics.features < 50 ? "lost: the image shows next to nothing"
                                               : "lost: the place is not recognised"};
  } else if (frames_ < kFramesNeeded) {
    status_ = {Health::kOk, "tracking"};
  } else if (chi2_per_row_ > kMaxChi2PerRow || inlier_share_ < kMinInlierShare) {
    status_ = {Health::kWarn,
               "residuals stay too large: intrinsics, extrinsics or time stamps may be wrong"};
  } else if (depth_share_ < kMinDepthShare * depth_possible_) {
    status_ = {Health::kWarn,
               "depth disagrees with what the camera sees: extrinsics or time stamps may be wrong"};
  } else if (const double excess = turn_excess(); excess != 0.0) {
    const auto percent = std::to_string(std::lround(100.0 * std::abs(excess)));
    status_ = {Health::kWarn,
               "the camera turns by " + percent + (excess > 0.0 ? " % more" : " % less") +
                   " than the gyro: focal length or time stamps may be wrong"};
  } else {
    status_ = {Health::kOk, "tracking"};
  }
}

}  // namespace camvox::tracking
