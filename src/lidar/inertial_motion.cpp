#include "camvox/lidar/inertial_motion.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace camvox::lidar {
namespace {

using geometry::SE3;
using geometry::SO3;

double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }
std::int64_t nanoseconds(double time_s) { return std::llround(1e9 * time_s); }
double square(double value) { return value * value; }

constexpr std::int64_t kKeep_ns = 3'000'000'000;  // of readings behind the newest odometry
constexpr std::int64_t kLongest_ns =
    12'000'000'000;  // of readings in all: bias_interval_s and more
constexpr std::int64_t kClockJump_ns = 1'000'000'000;

}  // namespace

InertialMotionFilter::InertialMotionFilter(const MotionFilterConfig& config)
    : config_(config), bias_variance_(square(config.gyro_bias_sigma_rad_s)) {
  config::require_valid(config, "motion");
}

double InertialMotionFilter::gyro_bias_sigma_rad_s() const { return std::sqrt(bias_variance_); }

void InertialMotionFilter::add_reading(const ImuReading& reading) {
  if (track_.newest_ns() && reading.stamp_ns < *track_.newest_ns() - kClockJump_ns) {
    track_.clear();
    known_ = false;
    turn_to_ns_ = -1;
  }
  track_.add(reading);
  track_.forget_before(reading.stamp_ns - kLongest_ns);
}

void InertialMotionFilter::forget_odometry() {
  known_ = false;
  turn_to_ns_ = -1;
  bias_variance_ = std::max(bias_variance_, square(config_.gyro_bias_sigma_rad_s));
}

void InertialMotionFilter::add_standstill(std::int64_t begin_ns, std::int64_t end_ns) {
  if (end_ns <= begin_ns || !track_.covers(begin_ns, end_ns, nanoseconds(config_.max_imu_gap_s))) {
    return;
  }
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (const auto& step : track_.steps(begin_ns, end_ns)) turn += step.dt_s * step.omega_rad_s;
  // The mean over a short time: white noise and the motor's trembling, not the bias's own drift.
  constexpr double kNoise_rad_sqrt_s = 5e-4;
  const double duration_s = seconds(end_ns - begin_ns);
  bias_variance_ += square(config_.gyro_bias_walk_rad_s2_sqrt_hz) * duration_s;
  correct_bias(turn / duration_s, kNoise_rad_sqrt_s / std::sqrt(duration_s));
}

void InertialMotionFilter::correct_bias(const Eigen::Vector3d& measured_rad_s, double sigma_rad_s) {
  const double gain = bias_variance_ / (bias_variance_ + square(sigma_rad_s));
  gyro_bias_rad_s_ += gain * (measured_rad_s - gyro_bias_rad_s_);
  bias_variance_ *= 1.0 - gain;
}

void InertialMotionFilter::add_odometry(const OdometryStep& step) {
  const bool usable = step.to_ns > step.from_ns &&
                      track_.covers(step.from_ns, step.to_ns, nanoseconds(config_.max_imu_gap_s));
  if (!usable) {
    known_ = false;
    return;
  }
  compare_turns(step);
  if (!known_ || state_ns_ != step.from_ns) {
    start(step);
  } else {
    propagate(step.from_ns, step.to_ns);
    // A step that contradicts the filter by many sigmas: tracking jumped, or the filter is wrong.
    const SO3 R_to_from = step.T_imu_from_imu_to.rotation().inverse();
    if (!correct(R_to_from * step.T_imu_from_imu_to.translation())) start(step);
  }
  state_ns_ = step.to_ns;
  p_imu_.setZero();
  covariance_.topRows<3>().setZero();
  covariance_.leftCols<3>().setZero();
  track_.forget_before(std::min(turn_from_ns_, step.to_ns - kKeep_ns));
}

/// Mean velocity of the step; gravity against the mean force, as if not accelerated.
void InertialMotionFilter::start(const OdometryStep& step) {
  const double dt_s = seconds(step.to_ns - step.from_ns);
  SO3 R_from_now;
  Eigen::Vector3d force_from = Eigen::Vector3d::Zero();
  for (const auto& part : track_.steps(step.from_ns, step.to_ns)) {
    force_from += part.dt_s * (R_from_now * part.force_m_s2);
    R_from_now = R_from_now * SO3::exp(part.dt_s * (part.omega_rad_s - gyro_bias_rad_s_));
  }
  const SO3 R_to_from = R_from_now.inverse();
  motion_.v_imu = R_to_from * (step.T_imu_from_imu_to.translation() / dt_s);
  motion_.gravity_imu = R_to_from * (-force_from / dt_s);
  constexpr double kAcceleration_m_s2 = 1.0;
  const double velocity_sigma_m_s =
      config_.odometry_sigma_m / dt_s + 0.5 * kAcceleration_m_s2 * dt_s;
  covariance_.setZero();
  covariance_.diagonal().segment<3>(3).setConstant(square(velocity_sigma_m_s));
  covariance_.diagonal().tail<3>().setConstant(square(kAcceleration_m_s2));
  known_ = true;
}

void InertialMotionFilter::propagate(std::int64_t from_ns, std::int64_t to_ns) {
  for (const auto& step : track_.steps(from_ns, to_ns)) {
    SE3 T_start_imu({}, p_imu_);
    advance(step, gyro_bias_rad_s_, T_start_imu, motion_);
    const SO3 R_before_after = T_start_imu.rotation();
    p_imu_ = R_before_after.inverse() * T_start_imu.translation();
    // F: all three are carried along and turned into the new axes.
    const Eigen::Matrix3d R = R_before_after.matrix().transpose();
    Matrix9d F = Matrix9d::Zero();
    F.block<3, 3>(0, 0) = F.block<3, 3>(3, 3) = F.block<3, 3>(6, 6) = R;
    F.block<3, 3>(0, 3) = F.block<3, 3>(3, 6) = step.dt_s * R;
    F.block<3, 3>(0, 6) = 0.5 * step.dt_s * step.dt_s * R;
    covariance_ = F * covariance_ * F.transpose();
    covariance_.diagonal().segment<3>(3).array() +=
        square(config_.accel_noise_m_s2_sqrt_hz) * step.dt_s;
    covariance_.diagonal().tail<3>().array() +=
        square(config_.gravity_walk_m_s3_sqrt_hz) * step.dt_s;
  }
}

bool InertialMotionFilter::correct(const Eigen::Vector3d& p_imu) {
  const Eigen::Vector3d innovation = p_imu - p_imu_;
  Eigen::Matrix3d S = covariance_.topLeftCorner<3, 3>();
  S.diagonal().array() += square(config_.odometry_sigma_m);
  const Eigen::LDLT<Eigen::Matrix3d> factors(S);
  constexpr double kGate = 40.0;  // 5.8 sigma with three degrees of freedom
  if (!(innovation.dot(factors.solve(innovation)) < kGate)) return false;
  const Eigen::Matrix<double, 9, 3> gain = factors.solve(covariance_.topRows<3>()).transpose();
  const Eigen::Matrix<double, 9, 1> change = gain * innovation;
  motion_.v_imu += change.segment<3>(3);
  motion_.gravity_imu += change.tail<3>();
  covariance_ -= gain * covariance_.topRows<3>();
  covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
  return true;
}

/// The gyro's turn over a second or so against odometry's: what is left over is bias. Its noise is
/// that of two poses, so that a longer interval tells more.
void InertialMotionFilter::compare_turns(const OdometryStep& step) {
  if (step.from_ns != turn_to_ns_) {
    turn_from_ns_ = step.from_ns;
    R_turn_odometry_ = {};
  }
  turn_to_ns_ = step.to_ns;
  R_turn_odometry_ = R_turn_odometry_ * step.T_imu_from_imu_to.rotation();
  const double interval_s = seconds(turn_to_ns_ - turn_from_ns_);
  if (interval_s < config_.bias_interval_s) return;
  const auto steps = track_.steps(turn_from_ns_, turn_to_ns_);
  const SO3 R_gyro = integrate_rotation(steps, gyro_bias_rad_s_);
  const Eigen::Vector3d rest_rad = (R_turn_odometry_.inverse() * R_gyro).log();
  bias_variance_ += square(config_.gyro_bias_walk_rad_s2_sqrt_hz) * interval_s;
  correct_bias(gyro_bias_rad_s_ + rest_rad / interval_s, config_.odometry_sigma_rad / interval_s);
  turn_from_ns_ = turn_to_ns_;
  R_turn_odometry_ = {};
}

std::optional<ImuMotion> InertialMotionFilter::predict(std::int64_t stamp_ns) const {
  const bool in_time = known_ && seconds(stamp_ns - state_ns_) <= config_.max_odometry_age_s;
  if (!in_time || !track_.covers(std::min(state_ns_, stamp_ns),
                                 std::max(state_ns_, stamp_ns),
                                 nanoseconds(config_.max_imu_gap_s))) {
    return std::nullopt;
  }
  SE3 T_start_imu;
  ImuMotion motion = motion_;
  for (const auto& step : track_.steps(state_ns_, stamp_ns)) {
    advance(step, gyro_bias_rad_s_, T_start_imu, motion);
  }
  return motion;
}

}  // namespace camvox::lidar
