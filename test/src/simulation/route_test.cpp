#include "camvox/simulation/route.hpp"

#include <gmock/gmock.h>

#include <numbers>

namespace camvox::simulation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

Route square() {
  Route route;
  route.legs = {
      Pause{1.0}, Drive{{{20, 0}, {20, 15}, {0, 15}, {0, 0}}, 2.0}, Turn{-kPi}, Pause{1.0}};
  return route;
}

TEST(Route, KeepsTheLimitsOfTheRobot) {
  const Trajectory trajectory = plan_route(square(), {});
  double fastest = 0.0;
  double sharpest = 0.0;
  for (double t = 0.0; t < trajectory.duration_s(); t += 0.01) {
    const KinematicState state = trajectory.state(t);
    fastest = std::max(fastest, state.v_world.norm());
    sharpest = std::max(sharpest, std::abs(state.omega_body.z()));
    // 0.7 along and 1.2 across the path, bumps on top.
    EXPECT_LT(state.a_world.head<2>().norm(), 1.6) << t;
    // Wheels do not slip sideways; the smoothing of path and heading over 0.4 s cuts a corner
    // by a few centimetres per second.
    const Vector3d v_body = state.T_world_body.rotation().inverse() * state.v_world;
    EXPECT_LT(std::abs(v_body.y()), 0.1) << t;
  }
  EXPECT_GT(fastest, 1.9);
  EXPECT_LT(fastest, 2.05);
  EXPECT_GT(sharpest, 0.6);
  EXPECT_LT(sharpest, 1.05);
}

TEST(Route, EndsWhereItShould) {
  const Trajectory trajectory = plan_route(square(), {});
  const auto end = trajectory.pose(trajectory.duration_s());
  EXPECT_LT(end.translation().head<2>().norm(), 0.02);
  // It came home heading south (-90 degrees), then turned by -180.
  EXPECT_LT(((end.rotation() * Vector3d::UnitX()) - Vector3d::UnitY()).head<2>().norm(), 0.03);
}

TEST(Route, TheGroundIsTheSameOnEveryVisit) {
  Route route;
  route.legs = {Drive{{{10, 0}}, 1.0}, Turn{kPi}, Drive{{{0, 0}}, 1.0}};
  Drivetrain robot;
  robot.bump_height_m = 0.01;
  const Trajectory trajectory = plan_route(route, robot);
  const double middle = 0.5 * trajectory.duration_s();
  double worst = 0.0;
  double highest = 0.0;
  for (double t = 1.0; t < middle - 2.0; t += 0.1) {
    const Vector3d there = trajectory.pose(t).translation();
    for (double u = middle; u < trajectory.duration_s(); u += 0.01) {
      const Vector3d back = trajectory.pose(u).translation();
      if ((there - back).head<2>().norm() < 0.005)
        worst = std::max(worst, std::abs(there.z() - back.z()));
    }
    highest = std::max(highest, std::abs(there.z()));
  }
  EXPECT_LT(worst, 0.001);
  EXPECT_GT(highest, 0.003);
}

TEST(Route, TurnsTowardsTheFirstWayPoint) {
  // Regression: a drive that began sideways made the heading jump (6.8 rad/s).
  Route route;
  route.legs = {Drive{{{0, 5}, {1, 5}, {1, 0}}, 2.5}};
  const Trajectory trajectory = plan_route(route, {});
  for (double t = 0.0; t < trajectory.duration_s(); t += 0.01) {
    EXPECT_LT(std::abs(trajectory.state(t).omega_body.z()), 1.1) << t;
  }
}

TEST(Route, RefusesAnEmptyOne) { EXPECT_THROW(plan_route({}, {}), std::logic_error); }

}  // namespace
}  // namespace camvox::simulation
