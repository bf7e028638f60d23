#include "camvox/optimization/point_observation.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace camvox::optimization {
namespace {

using geometry::SE3;
using geometry::Vector6d;

constexpr PinholeCamera kCamera{957.994, 955.328, 790.335, 250.663, 0.05};

struct Case {
  SE3 T_world_camera;
  Eigen::Vector3d p_world;
  PointObservation observation;
};

Case random_case(std::mt19937& random, bool with_depth) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  Vector6d xi;
  for (auto& value : xi) value = unit(random);
  Case c;
  c.T_world_camera = SE3::exp(xi);
  const Eigen::Vector3d p_camera(
      5.0 * unit(random), 2.0 * unit(random), 12.0 + 10.0 * unit(random));
  c.p_world = c.T_world_camera * p_camera;
  c.observation.u_px = {700.0 + 100.0 * unit(random), 250.0 + 100.0 * unit(random)};
  c.observation.sigma_px = 1.3;
  if (with_depth) {
    c.observation.depth_m = 12.0;
    c.observation.sigma_depth_m = 0.04;
  }
  return c;
}

class JacobianTest : public testing::TestWithParam<std::tuple<DepthModel, bool>> {};

// Central differences with a step of 1e-6 leave about 1e-9 of the Jacobian's size (up to 1e4).
TEST_P(JacobianTest, AgreesWithFiniteDifferences) {
  const auto [model, with_depth] = GetParam();
  std::mt19937 random(7);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const Case c = random_case(random, with_depth);
    const auto at = [&](const SE3& T, const Eigen::Vector3d& p) {
      return evaluate(T, p, c.observation, kCamera, model)->r;
    };
    const auto result = evaluate(c.T_world_camera, c.p_world, c.observation, kCamera, model);
    ASSERT_TRUE(result.has_value());
    EXPECT_EQ(result->rows, with_depth ? 3 : 2);
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      const Eigen::Vector3d numeric = (at(geometry::retract(c.T_world_camera, step), c.p_world) -
                                       at(geometry::retract(c.T_world_camera, -step), c.p_world)) /
                                      (2.0 * kStep);
      EXPECT_LT((result->J_pose.col(k) - numeric).norm(), 1e-5 * (1.0 + numeric.norm()));
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d numeric =
          (at(c.T_world_camera, c.p_world + step) - at(c.T_world_camera, c.p_world - step)) /
          (2.0 * kStep);
      EXPECT_LT((result->J_point.col(k) - numeric).norm(), 1e-5 * (1.0 + numeric.norm()));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(ModelsAndRows,
                         JacobianTest,
                         testing::Combine(testing::Values(DepthModel::kMetric,
                                                          DepthModel::kVirtualStereo),
                                          testing::Bool()));

TEST(PointObservationTest, IsInUnitsOfSigma) {
  PointObservation observation;
  observation.u_px = {kCamera.cx_px - 3.0, kCamera.cy_px + 1.0};
  observation.sigma_px = 2.0;
  observation.depth_m = 9.9;
  observation.sigma_depth_m = 0.05;
  const auto result = evaluate(SE3(), {0.0, 0.0, 10.0}, observation, kCamera, DepthModel::kMetric);
  ASSERT_TRUE(result.has_value());
  EXPECT_NEAR(result->r[0], 1.5, 1e-12);
  EXPECT_NEAR(result->r[1], -0.5, 1e-12);
  EXPECT_NEAR(result->r[2], 2.0, 1e-9);
}

// The paper's weakness (systems.md 1.A.9, 22): one pixel of u_R is 8.4 m at 20 m.
TEST(PointObservationTest, VirtualStereoHardlySeesFarDepth) {
  PointObservation observation;
  observation.u_px = {kCamera.cx_px, kCamera.cy_px};
  observation.depth_m = 20.0;
  observation.sigma_depth_m = 0.03;
  const Eigen::Vector3d p_world(0.0, 0.0, 21.0);
  const auto stereo = evaluate(SE3(), p_world, observation, kCamera, DepthModel::kVirtualStereo);
  const auto metric = evaluate(SE3(), p_world, observation, kCamera, DepthModel::kMetric);
  EXPECT_LT(std::abs(stereo->r[2]), 0.15);
  EXPECT_GT(std::abs(metric->r[2]), 30.0);
}

TEST(PointObservationTest, NothingBehindTheCameraOrNaN) {
  const PointObservation observation;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(evaluate(SE3(), {0.0, 0.0, -1.0}, observation, kCamera, DepthModel::kMetric));
  EXPECT_FALSE(evaluate(SE3(), {0.0, 0.0, 0.0}, observation, kCamera, DepthModel::kMetric));
  EXPECT_FALSE(evaluate(SE3(), {0.0, 0.0, nan}, observation, kCamera, DepthModel::kMetric));
}

}  // namespace
}  // namespace camvox::optimization
