#pragma once

#include "camvox/config/parameters.hpp"

namespace camvox::sensors {

/// Noise of an IMU in the usual model: measurement = truth + bias + white noise, the bias a random
/// walk. Densities are per root hertz: a sample at rate f has the white sigma density * sqrt(f),
/// and over a time t the bias moves by walk * sqrt(t). Defaults: an industrial MEMS unit of the
/// uINS class (0.16 deg/sqrt(h), 0.07 m/s/sqrt(h), a few deg/h and 40 micro-g in-run bias).
struct ImuNoise {
  double gyro_noise_rad_s_sqrt_hz = 4.7e-5;  ///< White noise of the angular rate.
  double accel_noise_m_s2_sqrt_hz = 1.2e-3;  ///< White noise of the specific force.
  double gyro_walk_rad_s2_sqrt_hz = 2.0e-6;  ///< Random walk of the gyro bias.
  double accel_walk_m_s3_sqrt_hz = 4.0e-5;   ///< Random walk of the accelerometer bias.
  double gyro_bias_sigma_rad_s = 3.0e-3;     ///< Turn-on bias, one sigma per axis.
  double accel_bias_sigma_m_s2 = 3.0e-2;     ///< Turn-on bias, one sigma per axis.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("gyro_noise_rad_s_sqrt_hz", self.gyro_noise_rad_s_sqrt_hz, config::at_least(0.0));
    field("accel_noise_m_s2_sqrt_hz", self.accel_noise_m_s2_sqrt_hz, config::at_least(0.0));
    field("gyro_walk_rad_s2_sqrt_hz", self.gyro_walk_rad_s2_sqrt_hz, config::at_least(0.0));
    field("accel_walk_m_s3_sqrt_hz", self.accel_walk_m_s3_sqrt_hz, config::at_least(0.0));
    field("gyro_bias_sigma_rad_s", self.gyro_bias_sigma_rad_s, config::at_least(0.0));
    field("accel_bias_sigma_m_s2", self.accel_bias_sigma_m_s2, config::at_least(0.0));
  }
};

}  // namespace camvox::sensors
