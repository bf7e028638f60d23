#include "camvox/simulation/inertial.hpp"

#include <Eigen/Geometry>
#include <cmath>

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;

constexpr std::uint64_t kImuStream = 20;
enum Kind : std::uint64_t {
  kGyroNoise,
  kAccelNoise,
  kGyroWalk,
  kAccelWalk,
  kGyroStart,
  kAccelStart
};

}  // namespace

ImuSample ideal_imu(const KinematicState& state, const geometry::SE3& T_body_imu) {
  const Vector3d arm = T_body_imu.translation();
  const Vector3d& w = state.omega_body;
  const Vector3d gravity_world(0.0, 0.0, -kGravity_m_s2);
  const Vector3d body = state.T_world_body.rotation().inverse() * (state.a_world - gravity_world);
  const Vector3d at_imu = body + state.alpha_body.cross(arm) + w.cross(w.cross(arm));
  const geometry::SO3 R_imu_body = T_body_imu.rotation().inverse();
  ImuSample sample;
  sample.omega_rad_s = R_imu_body * w;
  sample.force_m_s2 = R_imu_body * at_imu;
  sample.gyro_bias_rad_s.setZero();
  sample.accel_bias_m_s2.setZero();
  return sample;
}

ImuErrors::ImuErrors(const sensors::ImuNoise& noise, double rate_hz, std::uint64_t seed)
    : noise_(noise), rate_hz_(rate_hz), random_(seed, kImuStream) {
  gyro_bias_ = noise_.gyro_bias_sigma_rad_s * normal(0, kGyroStart);
  accel_bias_ = noise_.accel_bias_sigma_m_s2 * normal(0, kAccelStart);
}

Vector3d ImuErrors::normal(std::uint64_t index, std::uint64_t kind) const {
  return {random_.normal(index, 3 * kind),
          random_.normal(index, 3 * kind + 1),
          random_.normal(index, 3 * kind + 2)};
}

ImuSample ImuErrors::next(const ImuSample& ideal) {
  ImuSample sample = ideal;
  sample.gyro_bias_rad_s = gyro_bias_;
  sample.accel_bias_m_s2 = accel_bias_;
  const double white = std::sqrt(rate_hz_);
  sample.omega_rad_s +=
      gyro_bias_ + noise_.gyro_noise_rad_s_sqrt_hz * white * normal(index_, kGyroNoise);
  sample.force_m_s2 +=
      accel_bias_ + noise_.accel_noise_m_s2_sqrt_hz * white * normal(index_, kAccelNoise);
  const double step = 1.0 / white;
  gyro_bias_ += noise_.gyro_walk_rad_s2_sqrt_hz * step * normal(index_, kGyroWalk);
  accel_bias_ += noise_.accel_walk_m_s3_sqrt_hz * step * normal(index_, kAccelWalk);
  ++index_;
  return sample;
}

}  // namespace camvox::simulation
