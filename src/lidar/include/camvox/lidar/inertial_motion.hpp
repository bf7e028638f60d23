#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/lidar/imu_track.hpp"

namespace camvox::lidar {

/// Tuning of InertialMotionFilter. YAML keys are the field names.
struct MotionFilterConfig {
  double odometry_sigma_m = 0.01;               ///< Noise of the movement from frame to frame.
  double odometry_sigma_rad = 0.001;            ///< Noise of the turn over bias_interval_s.
  double accel_noise_m_s2_sqrt_hz = 0.02;       ///< Of the accelerometer, vibration included.
  double gravity_walk_m_s3_sqrt_hz = 0.02;      ///< Drift of gravity plus accelerometer bias.
  double gyro_bias_sigma_rad_s = 0.01;          ///< Of the bias before anything is known.
  double gyro_bias_walk_rad_s2_sqrt_hz = 2e-5;  ///< How fast the bias drifts.
  double bias_interval_s = 1.0;     ///< Turns of gyro and odometry are compared over it.
  double max_imu_gap_s = 0.15;      ///< A longer gap in the samples is not bridged.
  double max_odometry_age_s = 0.5;  ///< An older velocity is not used.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("odometry_sigma_m", self.odometry_sigma_m, positive);
    field("odometry_sigma_rad", self.odometry_sigma_rad, positive);
    field("accel_noise_m_s2_sqrt_hz", self.accel_noise_m_s2_sqrt_hz, positive);
    field("gravity_walk_m_s3_sqrt_hz", self.gravity_walk_m_s3_sqrt_hz, positive);
    field("gyro_bias_sigma_rad_s", self.gyro_bias_sigma_rad_s, positive);
    field("gyro_bias_walk_rad_s2_sqrt_hz", self.gyro_bias_walk_rad_s2_sqrt_hz, positive);
    field("bias_interval_s", self.bias_interval_s, positive, config::at_most(10.0));
    field("max_imu_gap_s", self.max_imu_gap_s, positive, config::at_most(1.0));
    field("max_odometry_age_s", self.max_odometry_age_s, positive, config::at_most(10.0));
  }
};

/// A step of visual odometry: how the camera moved between two frames.
struct OdometryStep {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;
  geometry::SE3 T_imu_from_imu_to;  ///< Pose of the IMU at `to` in the IMU frame at `from`.
};

/// Velocity, direction of gravity and gyro bias from IMU and odometry.
///
/// Odometry alone gives the mean velocity of the *last* frame interval; extrapolated through a
/// robot's acceleration of 1 m/s^2 to the middle of the next scan it is 15 cm/s off. A Kalman
/// filter over [movement since the last frame, velocity, gravity], all in the IMU's turning axes,
/// integrates the accelerometer in between and is linear given the gyro. Gravity is estimated, not
/// assumed: it takes up the accelerometer's bias, too. The gyro bias is estimated beside it: at
/// standstill from the mean rate, else from the turn over bias_interval_s compared with odometry's.
///
/// The state is that of the last odometry step; readings since then are kept, so that odometry may
/// come late.
class InertialMotionFilter {
 public:
  explicit InertialMotionFilter(const MotionFilterConfig& config);

  /// Readings that are known are ignored; one a second older than the newest means that the clock
  /// was set back, and everything but the bias starts anew.
  void add_reading(const ImuReading& reading);
  /// Takes readings of an interval in which the rig stood still.
  void add_standstill(std::int64_t begin_ns, std::int64_t end_ns);
  void add_odometry(const OdometryStep& step);
  /// Odometry was interrupted: velocity is unknown until it goes on.
  void forget_velocity() { known_ = false; }
  /// The axes of all odometry so far were wrong (new extrinsics): velocity is unknown until it goes
  /// on, and the gyro bias, which took up their error, as uncertain as before anything was known.
  void forget_odometry();

  /// The motion at a time at or after the last odometry step; nothing without odometry or when it
  /// is too old or the IMU has a gap.
  [[nodiscard]] std::optional<ImuMotion> predict(std::int64_t stamp_ns) const;

  [[nodiscard]] const ImuTrack& track() const { return track_; }
  [[nodiscard]] const Eigen::Vector3d& gyro_bias_rad_s() const { return gyro_bias_rad_s_; }
  [[nodiscard]] double gyro_bias_sigma_rad_s() const;
  [[nodiscard]] const MotionFilterConfig& config() const { return config_; }

 private:
  using Matrix9d = Eigen::Matrix<double, 9, 9>;

  void start(const OdometryStep& step);
  void propagate(std::int64_t from_ns, std::int64_t to_ns);
  bool correct(const Eigen::Vector3d& p_imu);
  void compare_turns(const OdometryStep& step);
  void correct_bias(const Eigen::Vector3d& measured_rad_s, double sigma_rad_s);

  MotionFilterConfig config_;
  ImuTrack track_;
  // The filter, at state_ns_: movement since the last odometry step, velocity, gravity.
  bool known_ = false;
  std::int64_t state_ns_ = 0;
  Eigen::Vector3d p_imu_ = Eigen::Vector3d::Zero();
  ImuMotion motion_;
  Matrix9d covariance_ = Matrix9d::Zero();
  // The gyro bias, and the turns that are being compared.
  Eigen::Vector3d gyro_bias_rad_s_ = Eigen::Vector3d::Zero();
  double bias_variance_ = 0.0;
  std::int64_t bias_ns_ = 0;
  std::int64_t turn_from_ns_ = 0;
  std::int64_t turn_to_ns_ = -1;
  geometry::SO3 R_turn_odometry_;
};

}  // namespace camvox::lidar
