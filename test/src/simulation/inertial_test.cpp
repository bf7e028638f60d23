#include "camvox/simulation/inertial.hpp"

#include <gmock/gmock.h>

#include <iostream>
#include <numbers>

#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/route.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;
using geometry::SE3;
using geometry::SO3;

Trajectory drive() {
  Route route;
  route.legs = {Pause{1.0}, Drive{{{20, 0}, {20, 15}, {0, 15}, {0, 0}}, 2.0}, Turn{3.0}};
  return plan_route(route, {});
}

TEST(IdealImu, AtRestFeelsGravityUpwards) {
  const ImuSample sample = ideal_imu({}, sensors::make_rig_calibration().T_body_imu());
  EXPECT_LT((sample.force_m_s2 - Vector3d(0, 0, 9.80665)).norm(), 1e-9);
  EXPECT_EQ(sample.omega_rad_s.norm(), 0.0);
}

TEST(IdealImu, LeverArmFeelsTheCentripetalAcceleration) {
  KinematicState spin;
  spin.omega_body = {0, 0, 2.0};
  const ImuSample sample =
      ideal_imu(spin, SE3(SO3::exp({0, 0, std::numbers::pi / 2}), {0.5, 0, 0}));
  // 2 rad/s at 0.5 m: 2 m/s^2 towards the centre, which is the IMU's +y.
  EXPECT_LT((sample.force_m_s2 - Vector3d(0, 2.0, 9.80665)).norm(), 1e-9);
}

TEST(IdealImu, IntegratesToTheTrajectory) {
  const Trajectory trajectory = drive();
  const SE3 T_body_imu = sensors::make_rig_calibration().T_body_imu();
  constexpr double kStep = 1.0 / 200.0;
  SE3 T = trajectory.pose(0.0) * T_body_imu;
  SO3 R = T.rotation();
  Vector3d p = T.translation();
  Vector3d v = Vector3d::Zero();
  const Vector3d gravity(0, 0, -kGravity_m_s2);
  const int steps = static_cast<int>(trajectory.duration_s() / kStep);
  ImuSample now = ideal_imu(trajectory.state(0.0), T_body_imu);
  for (int i = 1; i <= steps; ++i) {
    const ImuSample next = ideal_imu(trajectory.state(i * kStep), T_body_imu);
    const SO3 R_next = R * SO3::exp(0.5 * kStep * (now.omega_rad_s + next.omega_rad_s));
    const Vector3d a = 0.5 * (R * now.force_m_s2 + R_next * next.force_m_s2) + gravity;
    p += kStep * v + 0.5 * kStep * kStep * a;
    v += kStep * a;
    R = R_next;
    now = next;
  }
  const SE3 truth = trajectory.pose(steps * kStep) * T_body_imu;
  const double turned = (R.inverse() * truth.rotation()).angle_rad();
  const double moved = (p - truth.translation()).norm();
  std::cout << "IMU at 200 Hz over " << steps * kStep << " s: " << turned << " rad, " << moved
            << " m\n";
  // Trapezoids err by h^2 / 12 = 2e-6 s^2 of the change of the signal's slope, which sums to
  // little because the motion begins and ends at rest: some 1e-6 rad, which through gravity and
  // 44 s could drift 0.5 g 1e-6 t^2 = 1 cm at most.
  EXPECT_LT(turned, 1e-5);
  EXPECT_LT(moved, 0.01);
}

TEST(ImuErrors, HaveTheStatedSpreadAndTruth) {
  sensors::ImuNoise noise;
  noise.gyro_walk_rad_s2_sqrt_hz = 1e-3;
  ImuErrors errors(noise, 200.0, 7);
  const ImuSample ideal = ideal_imu({}, SE3());
  constexpr int kCount = 40'000;
  double white2 = 0.0;
  double walk2 = 0.0;
  Vector3d bias = Vector3d::Zero();
  for (int i = 0; i < kCount; ++i) {
    const ImuSample sample = errors.next(ideal);
    white2 += (sample.omega_rad_s - sample.gyro_bias_rad_s).squaredNorm() / (3 * kCount);
    if (i > 0) walk2 += (sample.gyro_bias_rad_s - bias).squaredNorm() / (3 * kCount);
    bias = sample.gyro_bias_rad_s;
  }
  // Density times root of the rate; 120 000 samples give the sigma to 0.2 %.
  EXPECT_NEAR(std::sqrt(white2), 4.7e-5 * std::sqrt(200.0), 0.01 * 4.7e-5 * std::sqrt(200.0));
  EXPECT_NEAR(std::sqrt(walk2), 1e-3 / std::sqrt(200.0), 0.01 * 1e-3 / std::sqrt(200.0));
}

}  // namespace
}  // namespace camvox::simulation
