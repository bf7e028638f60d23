#include "camvox/lidar/inertial_motion.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "camvox/test/moving_rig.hpp"

namespace camvox::lidar {
namespace {

using geometry::SE3;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kFrame_ns = 100 * kMs;

SE3 step_of(const test::MovingRig& rig, std::int64_t to_ns, double sigma_m, double sigma_rad) {
  const SE3 truth = rig.T_world_imu(to_ns - kFrame_ns).inverse() * rig.T_world_imu(to_ns);
  return test::noisy_step(truth, sigma_m, sigma_rad, static_cast<std::uint64_t>(to_ns));
}

Eigen::Vector3d true_velocity_imu(const test::MovingRig& rig, std::int64_t time_ns) {
  constexpr std::int64_t kTiny = 10'000;
  return rig.T_world_imu(time_ns).rotation().inverse() *
         ((rig.T_world_imu(time_ns + kTiny).translation() -
           rig.T_world_imu(time_ns - kTiny).translation()) /
          (2e-9 * kTiny));
}

struct Errors {
  double filter_m_s = 0.0;
  double last_step_m_s = 0.0;  ///< Of the mean velocity of the last step, in its place.
  double bias_rad_s = 0.0;
};

/// Runs the filter for 20 s; mean errors of the velocity predicted one frame ahead, second half.
Errors run(const test::MovingRig& rig, double sigma_m, double sigma_rad) {
  InertialMotionFilter filter({});
  const auto readings = rig.imu(0, 20'200 * kMs, {}, 3);
  auto next = readings.begin();
  Errors errors;
  int count = 0;
  for (std::int64_t time_ns = kFrame_ns; time_ns < 20'000 * kMs; time_ns += kFrame_ns) {
    for (; next->stamp_ns <= time_ns + kFrame_ns; ++next) filter.add_reading(*next);
    const auto T_step = step_of(rig, time_ns, sigma_m, sigma_rad);
    filter.add_odometry({time_ns - kFrame_ns, time_ns, T_step});
    const auto motion = filter.predict(time_ns + kFrame_ns);
    if (!motion || time_ns < 10'000 * kMs) continue;
    const auto truth = true_velocity_imu(rig, time_ns + kFrame_ns);
    errors.filter_m_s += (motion->v_imu - truth).norm();
    errors.last_step_m_s += (10.0 * T_step.translation() - truth).norm();
    ++count;
  }
  errors.filter_m_s /= count;
  errors.last_step_m_s /= count;
  simulation::ImuErrors imu({}, 200.0, 3);
  const auto bias = imu.next(simulation::ideal_imu({}, {})).gyro_bias_rad_s;
  errors.bias_rad_s = (filter.gyro_bias_rad_s() - bias).norm();
  return errors;
}

TEST(InertialMotionFilter, PredictsVelocityFarBetterThanTheLastStep) {
  for (const auto& rig : {test::MovingRig::driving(21.0), test::MovingRig::handheld(21.0)}) {
    const auto errors = run(rig, 0.005, 0.0005);
    EXPECT_LT(errors.filter_m_s, 0.05);
    EXPECT_LT(errors.filter_m_s, 0.5 * errors.last_step_m_s);
  }
}

TEST(InertialMotionFilter, LearnsTheGyroBiasFromOdometry) {
  // Turn-on bias 3 mrad/s an axis. Ten steps of 0.5 mrad make 1.6 mrad/s over a second; 20 such
  // measurements leave 0.36 mrad/s an axis, 0.6 in all; the bound is 2.5 times that.
  EXPECT_LT(run(test::MovingRig::driving(21.0), 0.005, 0.0005).bias_rad_s, 1.5e-3);
}

TEST(InertialMotionFilter, LearnsTheGyroBiasAtStandstill) {
  InertialMotionFilter filter({});
  const Eigen::Vector3d bias(0.004, -0.01, 0.002);
  for (std::int64_t ms = 0; ms <= 2000; ms += 5) {
    filter.add_reading({ms * kMs, bias, Eigen::Vector3d(0.0, 0.0, 9.8)});
  }
  for (std::int64_t ms = 0; ms < 2000; ms += 100) filter.add_standstill(ms * kMs, (ms + 100) * kMs);
  EXPECT_LT((filter.gyro_bias_rad_s() - bias).norm(), 1e-4);
  EXPECT_LT(filter.gyro_bias_sigma_rad_s(), 1e-3);
}

TEST(InertialMotionFilter, ForgetsVelocityWhenOdometryStopsOrTheImuHasAGap) {
  InertialMotionFilter filter({});
  EXPECT_FALSE(filter.predict(0));
  const auto rig = test::MovingRig::driving(4.0);
  for (const auto& reading : rig.imu(0, 2'000 * kMs, {})) filter.add_reading(reading);
  filter.add_odometry({0, kFrame_ns, step_of(rig, kFrame_ns, 0, 0)});
  EXPECT_TRUE(filter.predict(2 * kFrame_ns));
  EXPECT_FALSE(filter.predict(7 * kFrame_ns));  // too old
  filter.forget_velocity();
  EXPECT_FALSE(filter.predict(2 * kFrame_ns));
  filter.add_odometry({kFrame_ns, 2 * kFrame_ns, step_of(rig, 2 * kFrame_ns, 0, 0)});
  EXPECT_TRUE(filter.predict(3 * kFrame_ns));
  filter.add_odometry({2'900 * kMs, 3'000 * kMs, {}});  // beyond the readings
  EXPECT_FALSE(filter.predict(3'100 * kMs));
}

TEST(InertialMotionFilter, StartsAnewAfterAJumpOfOdometry) {
  const auto rig = test::MovingRig::driving(6.0);
  InertialMotionFilter filter({});
  for (const auto& reading : rig.imu(0, 5'000 * kMs, {})) filter.add_reading(reading);
  for (std::int64_t time_ns = kFrame_ns; time_ns <= 4'000 * kMs; time_ns += kFrame_ns) {
    SE3 T_step = step_of(rig, time_ns, 0.002, 0.0005);
    if (time_ns == 2'000 * kMs) T_step = T_step * SE3({}, Eigen::Vector3d(1.0, 0.0, 0.0));
    filter.add_odometry({time_ns - kFrame_ns, time_ns, T_step});
  }
  const auto motion = filter.predict(4'100 * kMs);
  ASSERT_TRUE(motion);
  EXPECT_LT((motion->v_imu - true_velocity_imu(rig, 4'100 * kMs)).norm(), 0.1);
}

TEST(InertialMotionFilter, FollowsAClockThatWasSetBack) {
  const auto rig = test::MovingRig::driving(4.0);
  InertialMotionFilter filter({});
  for (std::int64_t ms = 90'000; ms < 91'000; ms += 5) filter.add_reading({ms * kMs, {}, {}});
  for (const auto& reading : rig.imu(0, 2'000 * kMs, {})) filter.add_reading(reading);
  filter.add_odometry({0, kFrame_ns, step_of(rig, kFrame_ns, 0, 0)});
  EXPECT_TRUE(filter.predict(2 * kFrame_ns));
}

/// A steady turn of 0.8 rad/s about z without any bias, and odometry whose axes are turned about x.
/// The difference of the two turns is 2 sin(error / 2) of it, which looks like bias.
TEST(InertialMotionFilter, ForgetsWhatOdometrySaidInWrongAxes) {
  constexpr double kRate_rad_s = 0.8;
  const double error_rad = 3.0 * std::numbers::pi / 180.0;
  InertialMotionFilter filter({.bias_interval_s = 0.2});
  for (std::int64_t ms = 0; ms <= 10'000; ms += 5) {
    filter.add_reading({ms * kMs, {0.0, 0.0, kRate_rad_s}, {0.0, 0.0, 9.8}});
  }
  const auto turn = [&](std::int64_t from_ns, std::int64_t to_ns, double wrong_rad) {
    const auto R_wrong = geometry::SO3::exp({wrong_rad, 0.0, 0.0});
    const auto R_step = geometry::SO3::exp({0.0, 0.0, 0.1 * kRate_rad_s});
    const SE3 T_step(R_wrong.inverse() * R_step * R_wrong, {0.0, 0.0, 0.0});
    for (auto ns = from_ns; ns < to_ns; ns += kFrame_ns) {
      filter.add_odometry({ns, ns + kFrame_ns, T_step});
    }
  };
  turn(0, 6'000 * kMs, error_rad);
  const double booked_rad_s = 2.0 * std::sin(0.5 * error_rad) * kRate_rad_s;
  EXPECT_NEAR(filter.gyro_bias_rad_s().norm(), booked_rad_s, 0.1 * booked_rad_s);
  filter.forget_odometry();
  EXPECT_FALSE(filter.predict(6'100 * kMs));
  EXPECT_GE(filter.gyro_bias_sigma_rad_s(), filter.config().gyro_bias_sigma_rad_s);
  // Ten comparisons of 1 mrad / 0.2 s against what it was, 10 mrad/s: 1 / (1 + 10 * 4) is left.
  turn(6'000 * kMs, 8'000 * kMs, 0.0);
  EXPECT_TRUE(filter.predict(8'100 * kMs));
  EXPECT_LT(filter.gyro_bias_rad_s().norm(), 0.05 * booked_rad_s);
}

TEST(InertialMotionFilter, MemoryIsBoundedWithoutOdometry) {
  InertialMotionFilter filter({});
  for (std::int64_t ms = 0; ms < 100'000; ms += 5) filter.add_reading({ms * kMs, {}, {}});
  EXPECT_LE(filter.track().size(), 2500U);
}

TEST(InertialMotionFilter, IsRepeatable) {
  const auto rig = test::MovingRig::handheld(21.0);
  EXPECT_EQ(run(rig, 0.005, 0.0005).filter_m_s, run(rig, 0.005, 0.0005).filter_m_s);
}

}  // namespace
}  // namespace camvox::lidar
