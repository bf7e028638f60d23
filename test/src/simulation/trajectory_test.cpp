#include "camvox/simulation/trajectory.hpp"

#include <gmock/gmock.h>

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;
using geometry::SE3;
using geometry::SO3;

/// A lively motion: every axis turns and moves.
Trajectory lively() {
  std::vector<SE3> poses;
  for (int i = 0; i < 40; ++i) {
    const double t = 0.1 * i;
    poses.emplace_back(SO3::exp({0.4 * std::sin(t), 0.3 * std::cos(2 * t), t}),
                       Vector3d(2 * t, std::sin(3 * t), 0.3 * std::cos(4 * t)));
  }
  return {poses, 0.1};
}

TEST(Trajectory, DerivativesAgreeWithFiniteDifferences) {
  const Trajectory trajectory = lively();
  // Steps of 1e-4 s: truncation about 1e-6 of third derivatives near 100, rounding 1e-8 for the
  // second derivatives.
  constexpr double h = 1e-4;
  for (double t = 0.2035; t < 3.7; t += 0.0737) {
    const KinematicState state = trajectory.state(t);
    const SE3 before = trajectory.pose(t - h);
    const SE3 after = trajectory.pose(t + h);
    EXPECT_LT(geometry::local(state.T_world_body, trajectory.pose(t)).norm(), 1e-12);
    const Vector3d v = (after.translation() - before.translation()) / (2 * h);
    EXPECT_LT((state.v_world - v).norm(), 1e-5);
    const Vector3d w = (before.rotation().inverse() * after.rotation()).log() / (2 * h);
    EXPECT_LT((state.omega_body - w).norm(), 1e-5);
    const KinematicState s0 = trajectory.state(t - h);
    const KinematicState s1 = trajectory.state(t + h);
    EXPECT_LT((state.a_world - (s1.v_world - s0.v_world) / (2 * h)).norm(), 2e-3);
    EXPECT_LT((state.alpha_body - (s1.omega_body - s0.omega_body) / (2 * h)).norm(), 2e-3);
  }
}

TEST(Trajectory, SecondDerivativesAreContinuousAcrossKnots) {
  const Trajectory trajectory = lively();
  for (double knot = 0.1; knot < 3.8; knot += 0.1) {
    const KinematicState before = trajectory.state(knot - 1e-9);
    const KinematicState after = trajectory.state(knot + 1e-9);
    EXPECT_LT((before.a_world - after.a_world).norm(), 1e-5);
    EXPECT_LT((before.alpha_body - after.alpha_body).norm(), 1e-5);
  }
}

TEST(Trajectory, StandsStillBeforeStartAndAfterEnd) {
  const Trajectory trajectory = lively();
  for (const double t : {-100.0, -0.3, trajectory.duration_s() + 0.3, 1e6}) {
    const KinematicState state = trajectory.state(t);
    EXPECT_LT(state.v_world.norm(), 1e-12) << t;
    EXPECT_LT(state.omega_body.norm(), 1e-12) << t;
    EXPECT_LT(state.a_world.norm(), 1e-9) << t;
  }
  EXPECT_EQ(Trajectory({SE3()}, 0.1).duration_s(), 0.0);
}

TEST(Trajectory, RefusesNonsense) {
  EXPECT_THROW(Trajectory({}, 0.1), std::logic_error);
  EXPECT_THROW(Trajectory({SE3()}, 0.0), std::logic_error);
  EXPECT_THROW(follow_poses({{0.0, SE3()}}, 0.1), std::logic_error);
  EXPECT_THROW(follow_poses({{0.0, SE3()}, {0.0, SE3()}}, 0.1), std::logic_error);
}

TEST(FollowPoses, StaysNearARecordedMotion) {
  // A circle of radius 5 m at 1 m/s, sampled unevenly around 10 Hz: linear interpolation is off by
  // (1 m/s 0.12 s)^2 / (8 r) = 0.4 mm, the spline by dt^2 / 6 a = 0.3 mm more.
  std::vector<TimedPose> poses;
  const auto circle = [](double t) {
    return SE3(SO3::exp({0, 0, t / 5}), {5 * std::sin(t / 5), 5 - 5 * std::cos(t / 5), 0});
  };
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 * i + (i % 3) * 0.01;
    poses.push_back({1000.0 + t, circle(t)});
  }
  const Trajectory trajectory = follow_poses(poses, 0.1);
  for (double t = 0.5; t < 9.0; t += 0.05) {
    const auto error = geometry::local(circle(t), trajectory.pose(t));
    EXPECT_LT(error.tail<3>().norm(), 2e-3);
    EXPECT_LT(error.head<3>().norm(), 1e-3);
  }
}

}  // namespace
}  // namespace camvox::simulation
