#include "camvox/tracking/health.hpp"

#include <algorithm>

namespace camvox::tracking {
namespace {

constexpr double kNewWeight = 0.05;     ///< Of a frame in the averages.
constexpr int kFramesNeeded = 20;       ///< Before the averages say anything.
constexpr double kMaxChi2PerRow = 1.5;  ///< Good ones have 0.3 to 1.
constexpr double kMinInlierShare = 0.5;
constexpr double kMinDepthShare = 0.4;  ///< Of what features with depth let expect.

void average(double& mean, double value) { mean += kNewWeight * (value - mean); }

}  // namespace

void HealthMonitor::add(const FrameResult& result) {
  const auto& s = result.statistics;
  if (result.has_pose() && s.matches > 0 && s.inliers > 0 && s.features > 0) {
    frames_ = std::min(frames_ + 1, kFramesNeeded);
    average(chi2_per_row_, s.chi2_per_row);
    average(inlier_share_, static_cast<double>(s.inliers) / s.matches);
    average(depth_share_, static_cast<double>(s.inliers_with_depth) / s.inliers);
    average(depth_possible_, static_cast<double>(s.features_with_depth) / s.features);
  }
  judge(result);
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
  } else {
    status_ = {Health::kOk, "tracking"};
  }
}

}  // namespace camvox::tracking
