#include "camvox/tracking/motion_limit.hpp"

#include <stdexcept>

namespace camvox::tracking {
namespace {

constexpr double kPoseNoise_m = 0.03;  ///< Steps when the map changes, which no covariance knows.
constexpr double kSigmas = 3.0;

}  // namespace

MotionLimit::MotionLimit(double max_acceleration_mps2)
    : max_acceleration_mps2_(max_acceleration_mps2) {}

void MotionLimit::observe(const geometry::SE3& T_last_camera, double dt_s) {
  if (!(dt_s > 0.0)) throw std::logic_error("MotionLimit: time must go on");
  velocity_mps_ = T_last_camera.rotation().inverse() * T_last_camera.translation() / dt_s;
  over_s_ = dt_s;
}

// The mean velocity is that of half an interval ago, so that with constant acceleration a the
// camera is a * over / 2 * dt + a / 2 * dt^2 away from where that velocity leads.
bool MotionLimit::allows(const geometry::SE3& T_last_camera, double dt_s, double sigma_m) const {
  if (!velocity_mps_ || max_acceleration_mps2_ <= 0.0) return true;
  const double off_m = (T_last_camera.translation() - *velocity_mps_ * dt_s).norm();
  const double reach_m = 0.5 * max_acceleration_mps2_ * dt_s * (over_s_ + dt_s);
  return off_m <= reach_m + (kPoseNoise_m + kSigmas * sigma_m) * (1.0 + dt_s / over_s_);
}

}  // namespace camvox::tracking
