#include "camvox/lidar/imu_track.hpp"

#include <gtest/gtest.h>

#include "camvox/test/moving_rig.hpp"

namespace camvox::lidar {
namespace {

using geometry::SE3;
using geometry::SO3;

constexpr std::int64_t kMs = 1'000'000;

ImuTrack regular(std::int64_t from_ms, std::int64_t to_ms) {
  ImuTrack track;
  for (std::int64_t ms = from_ms; ms <= to_ms; ms += 5) {
    track.add({ms * kMs, Eigen::Vector3d(0.0, 0.0, 0.001 * static_cast<double>(ms)), {}});
  }
  return track;
}

TEST(ImuTrack, StepsCoverTheIntervalExactly) {
  const auto track = regular(0, 100);
  for (const auto& [from, to] : {std::pair{12, 58}, {58, 12}, {10, 20}, {20, 10}, {13, 14}}) {
    double time_s = 0.0, turn_rad = 0.0;
    for (const auto& step : track.steps(from * kMs, to * kMs)) {
      time_s += step.dt_s;
      turn_rad += step.dt_s * step.omega_rad_s.z();
    }
    EXPECT_NEAR(time_s, 1e-3 * (to - from), 1e-12);
    // The integral of a rate that grows linearly: exact.
    EXPECT_NEAR(turn_rad, 0.5e-6 * (to * to - from * from), 1e-12);
  }
  EXPECT_TRUE(track.steps(5, 5).empty());
  EXPECT_TRUE(ImuTrack().steps(0, 5).empty());
}

TEST(ImuTrack, KnowsGaps) {
  auto track = regular(0, 100);
  for (std::int64_t ms = 160; ms <= 200; ms += 5) track.add({ms * kMs, {}, {}});
  EXPECT_TRUE(track.covers(3 * kMs, 97 * kMs, 10 * kMs));
  EXPECT_TRUE(track.covers(3 * kMs, 108 * kMs, 10 * kMs) == false);
  EXPECT_FALSE(track.covers(50 * kMs, 180 * kMs, 50 * kMs));
  EXPECT_TRUE(track.covers(50 * kMs, 180 * kMs, 60 * kMs));
  EXPECT_TRUE(track.covers(160 * kMs, 200 * kMs, 5 * kMs));
  EXPECT_TRUE(track.covers(190 * kMs, 204 * kMs, 5 * kMs));
  EXPECT_FALSE(track.covers(190 * kMs, 206 * kMs, 5 * kMs));
  EXPECT_FALSE(track.covers(300 * kMs, 310 * kMs, 50 * kMs));
  EXPECT_FALSE(ImuTrack().covers(0, 1, kMs));
}

TEST(ImuTrack, IgnoresReadingsThatAreKnown) {
  auto track = regular(0, 100);
  track.add({50 * kMs, Eigen::Vector3d(9.0, 9.0, 9.0), {}});
  EXPECT_NEAR(track.omega_rad_s(50 * kMs).z(), 0.05, 1e-12);
  track.forget_before(52 * kMs);
  EXPECT_NEAR(track.omega_rad_s(51 * kMs).z(), 0.051, 1e-12);
}

class Strapdown : public ::testing::TestWithParam<bool> {};

// Position and attitude from an ideal IMU against the trajectory, forwards and backwards in time.
TEST_P(Strapdown, FollowsTheTrajectory) {
  const auto rig = test::MovingRig::handheld(5.0);
  sensors::ImuNoise ideal{};
  ideal.gyro_bias_sigma_rad_s = ideal.accel_bias_sigma_m_s2 = 0.0;
  ideal.gyro_noise_rad_s_sqrt_hz = ideal.accel_noise_m_s2_sqrt_hz = 0.0;
  ideal.gyro_walk_rad_s2_sqrt_hz = ideal.accel_walk_m_s3_sqrt_hz = 0.0;
  ImuTrack track;
  for (const auto& reading : rig.imu(0, 5'000 * kMs, ideal)) track.add(reading);
  std::int64_t from_ns = 2'003 * kMs, to_ns = 2'203 * kMs;
  if (GetParam()) std::swap(from_ns, to_ns);
  const auto T_world_from = rig.T_world_imu(from_ns);
  const SO3 R_from_world = T_world_from.rotation().inverse();
  constexpr std::int64_t kTiny = 10'000;
  const Eigen::Vector3d v_world = (rig.T_world_imu(from_ns + kTiny).translation() -
                                   rig.T_world_imu(from_ns - kTiny).translation()) /
                                  (2e-9 * kTiny);
  ImuMotion motion{R_from_world * v_world,
                   R_from_world * Eigen::Vector3d(0, 0, -simulation::kGravity_m_s2)};
  SE3 T_from_to;
  for (const auto& step : track.steps(from_ns, to_ns)) {
    advance(step, Eigen::Vector3d::Zero(), T_from_to, motion);
  }
  const auto error = geometry::local(T_world_from.inverse() * rig.T_world_imu(to_ns), T_from_to);
  // 40 steps of trapezoids: second order, 0.2 s of 8 m/s^2 with a jerk of 30 m/s^3.
  EXPECT_LT(error.head<3>().norm(), 2e-5);
  EXPECT_LT(error.tail<3>().norm(), 2e-4);
  EXPECT_NEAR((integrate_rotation(track.steps(from_ns, to_ns), Eigen::Vector3d::Zero()).inverse() *
               T_from_to.rotation())
                  .angle_rad(),
              0.0,
              1e-9);
}
INSTANTIATE_TEST_SUITE_P(Directions, Strapdown, ::testing::Bool());

}  // namespace
}  // namespace camvox::lidar
