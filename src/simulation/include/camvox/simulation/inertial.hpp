#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/imu_noise.hpp"
#include "camvox/simulation/random.hpp"
#include "camvox/simulation/trajectory.hpp"

namespace camvox::simulation {

/// Standard gravity; the world's z axis is up.
inline constexpr double kGravity_m_s2 = 9.80665;

/// One measurement of the IMU, in its own frame.
struct ImuSample {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d omega_rad_s;      ///< Angular rate.
  Eigen::Vector3d force_m_s2;       ///< Specific force: +g upwards at rest.
  Eigen::Vector3d gyro_bias_rad_s;  ///< Truth: part of omega_rad_s.
  Eigen::Vector3d accel_bias_m_s2;  ///< Truth: part of force_m_s2.
};

/// What an IMU without errors at `T_body_imu` measures: lever arm and rotation included.
[[nodiscard]] ImuSample ideal_imu(const KinematicState& state, const geometry::SE3& T_body_imu);

/// Adds bias and noise, sample after sample.
class ImuErrors {
 public:
  ImuErrors(const sensors::ImuNoise& noise, double rate_hz, std::uint64_t seed);

  /// Puts the errors of the next sample on `ideal`; stamps are left alone.
  [[nodiscard]] ImuSample next(const ImuSample& ideal);

 private:
  [[nodiscard]] Eigen::Vector3d normal(std::uint64_t index, std::uint64_t kind) const;

  sensors::ImuNoise noise_;
  double rate_hz_;
  CounterRandom random_;
  std::uint64_t index_ = 0;
  Eigen::Vector3d gyro_bias_;
  Eigen::Vector3d accel_bias_;
};

}  // namespace camvox::simulation
