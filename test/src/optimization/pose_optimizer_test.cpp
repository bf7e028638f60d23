#include "camvox/optimization/pose_optimizer.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace camvox::optimization {
namespace {

using geometry::SE3;
using geometry::SO3;
using geometry::Vector6d;

constexpr PinholeCamera kCamera{957.994, 955.328, 790.335, 250.663, 0.05};

struct Scene {
  SE3 T_world_camera;
  std::vector<LandmarkMatch> matches;
};

struct SceneOptions {
  int landmarks = 400;
  double noise_px = 0.0;
  double noise_depth_m = 0.0;
  double sigma_px = 1.0;
  double sigma_depth_m = 0.03;
  double depth_share = 0.6;
  double outlier_share = 0.0;
};

/// A street-like scene, 4 to 60 m away, seen with noise; outliers point somewhere in the image.
Scene make_scene(std::mt19937& random, const SceneOptions& options) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> normal;
  Scene scene;
  scene.T_world_camera = SE3(SO3::exp({0.2, -0.4, 0.1}), {30.0, -12.0, 2.0});
  for (int i = 0; i < options.landmarks; ++i) {
    const Eigen::Vector2d u_px(1520.0 * unit(random), 568.0 * unit(random));
    const double depth_m = 4.0 + 56.0 * unit(random) * unit(random);
    const Eigen::Vector3d p_camera((u_px.x() - kCamera.cx_px) / kCamera.fx_px * depth_m,
                                   (u_px.y() - kCamera.cy_px) / kCamera.fy_px * depth_m,
                                   depth_m);
    LandmarkMatch match;
    match.p_world = scene.T_world_camera * p_camera;
    match.observation.u_px =
        u_px + options.noise_px * Eigen::Vector2d(normal(random), normal(random));
    match.observation.sigma_px = options.sigma_px;
    if (unit(random) < options.depth_share) {
      match.observation.depth_m = depth_m + options.noise_depth_m * normal(random);
      match.observation.sigma_depth_m = options.sigma_depth_m;
    }
    if (unit(random) < options.outlier_share) {
      match.observation.u_px = {1520.0 * unit(random), 568.0 * unit(random)};
      if (match.observation.depth_m > 0.0) match.observation.depth_m = 4.0 + 56.0 * unit(random);
    }
    scene.matches.push_back(match);
  }
  return scene;
}

SE3 moved(const SE3& T, double angle_rad, double distance_m) {
  Vector6d xi;
  xi << 0.6, -0.64, 0.48, 0.48, 0.6, 0.64;
  xi.head<3>() *= angle_rad;
  xi.tail<3>() *= distance_m;
  return geometry::retract(T, xi);
}

class PoseOptimizerTest : public testing::TestWithParam<DepthModel> {
 protected:
  PoseOptimizerOptions options() const {
    PoseOptimizerOptions options;
    options.depth_model = GetParam();
    return options;
  }
};

TEST_P(PoseOptimizerTest, FindsTheExactPoseWithoutNoise) {
  std::mt19937 random(1);
  const Scene scene = make_scene(random, {});
  const auto estimate =
      optimize_pose(moved(scene.T_world_camera, 0.03, 0.5), scene.matches, kCamera, options());
  ASSERT_EQ(estimate.status, PoseEstimate::Status::kOk);
  EXPECT_EQ(estimate.inliers, 400);
  EXPECT_LT(geometry::local(scene.T_world_camera, estimate.T_world_camera).norm(), 1e-6);
}

TEST_P(PoseOptimizerTest, WithstandsOneThirdOfOutliers) {
  std::mt19937 random(2);
  SceneOptions scene_options;
  scene_options.noise_px = 0.8;
  scene_options.noise_depth_m = 0.03;
  scene_options.outlier_share = 0.33;
  for (int run = 0; run < 20; ++run) {
    const Scene scene = make_scene(random, scene_options);
    const auto estimate =
        optimize_pose(moved(scene.T_world_camera, 0.02, 0.4), scene.matches, kCamera, options());
    ASSERT_EQ(estimate.status, PoseEstimate::Status::kOk);
    const Vector6d error = geometry::local(scene.T_world_camera, estimate.T_world_camera);
    // 265 good matches at 0.8 px: about 0.05 px of the mean, so 5e-5 rad and some millimetres;
    // five times that.
    EXPECT_LT(error.head<3>().norm(), 5e-4);
    EXPECT_LT(error.tail<3>().norm(), 0.03);
    EXPECT_GT(estimate.inliers, 240);
    EXPECT_LT(estimate.inliers, 290);
  }
}

// The normalised error squared of a consistent estimate is chi^2 distributed with 6 degrees of
// freedom: mean 6, and the mean of 200 runs has a sigma of sqrt(12 / 200) = 0.25. The gates cut 5 %
// of the tails, which makes the stated covariance a little optimistic.
TEST_P(PoseOptimizerTest, CovarianceTellsTheError) {
  std::mt19937 random(3);
  SceneOptions scene_options;
  scene_options.noise_px = 1.0;
  scene_options.noise_depth_m = 0.03;
  double sum = 0.0;
  constexpr int kRuns = 200;
  for (int run = 0; run < kRuns; ++run) {
    const Scene scene = make_scene(random, scene_options);
    const auto estimate = optimize_pose(scene.T_world_camera, scene.matches, kCamera, options());
    ASSERT_EQ(estimate.status, PoseEstimate::Status::kOk);
    const Vector6d error = geometry::local(scene.T_world_camera, estimate.T_world_camera);
    sum += error.dot(estimate.covariance_camera.ldlt().solve(error));
  }
  if (GetParam() == DepthModel::kMetric) {
    EXPECT_NEAR(sum / kRuns, 6.0, 2.0);
  } else {
    // The virtual stereo row repeats the pixel's own noise, so its covariance is too small.
    EXPECT_LT(sum / kRuns, 20.0);
  }
}

TEST_P(PoseOptimizerTest, TooFewMatchesAreNoEstimate) {
  std::mt19937 random(4);
  Scene scene = make_scene(random, {.landmarks = 9});
  const auto estimate = optimize_pose(scene.T_world_camera, scene.matches, kCamera, options());
  EXPECT_EQ(estimate.status, PoseEstimate::Status::kTooFewMatches);
  EXPECT_EQ(optimize_pose(SE3(), {}, kCamera, options()).status,
            PoseEstimate::Status::kTooFewMatches);
}

TEST_P(PoseOptimizerTest, LandmarksInOnePointAreDegenerate) {
  std::mt19937 random(5);
  Scene scene = make_scene(random, {.landmarks = 1, .depth_share = 1.0});
  scene.matches.resize(50, scene.matches.front());
  const auto estimate = optimize_pose(scene.T_world_camera, scene.matches, kCamera, options());
  EXPECT_EQ(estimate.status, PoseEstimate::Status::kDegenerate);
}

TEST_P(PoseOptimizerTest, NanAndPointsBehindAreOutliers) {
  std::mt19937 random(6);
  Scene scene = make_scene(random, {});
  scene.matches[3].p_world.x() = std::numeric_limits<double>::quiet_NaN();
  scene.matches[4].p_world = scene.T_world_camera * Eigen::Vector3d(0.0, 0.0, -5.0);
  const auto estimate =
      optimize_pose(moved(scene.T_world_camera, 0.01, 0.1), scene.matches, kCamera, options());
  ASSERT_EQ(estimate.status, PoseEstimate::Status::kOk);
  EXPECT_EQ(estimate.inliers, 398);
  EXPECT_EQ(estimate.uses[3], MatchUse::kOutlier);
  EXPECT_EQ(estimate.uses[4], MatchUse::kOutlier);
}

TEST_P(PoseOptimizerTest, RepeatsBitByBit) {
  std::mt19937 random(7);
  const Scene scene = make_scene(random, {.noise_px = 1.0, .outlier_share = 0.2});
  const SE3 T_start = moved(scene.T_world_camera, 0.02, 0.4);
  const auto first = optimize_pose(T_start, scene.matches, kCamera, options());
  const auto second = optimize_pose(T_start, scene.matches, kCamera, options());
  EXPECT_EQ(first.T_world_camera.matrix(), second.T_world_camera.matrix());
}

INSTANTIATE_TEST_SUITE_P(Models,
                         PoseOptimizerTest,
                         testing::Values(DepthModel::kMetric, DepthModel::kVirtualStereo));

// A wrong depth costs a match its depth, not its pixel.
TEST(PoseOptimizerDepthTest, DisagreeingDepthIsLeftOut) {
  std::mt19937 random(8);
  Scene scene = make_scene(random, {.depth_share = 1.0});
  for (std::size_t i = 0; i < 100; ++i) scene.matches[i].observation.depth_m *= 1.5;
  const auto estimate = optimize_pose(scene.T_world_camera, scene.matches, kCamera);
  ASSERT_EQ(estimate.status, PoseEstimate::Status::kOk);
  EXPECT_EQ(estimate.inliers, 400);
  EXPECT_EQ(estimate.inliers_with_depth, 300);
  EXPECT_EQ(estimate.uses[0], MatchUse::kPixel);
  EXPECT_LT(geometry::local(scene.T_world_camera, estimate.T_world_camera).norm(), 1e-6);
}

// Twelve landmarks leave the rotation weak; a prior holds it.
TEST(PoseOptimizerPriorTest, RotationPriorHelpsFewMatches) {
  std::mt19937 random(9);
  SceneOptions scene_options{.landmarks = 12, .noise_px = 1.0, .depth_share = 0.0};
  PosePrior prior;
  prior.information.diagonal().head<3>().setConstant(1.0 / (1e-4 * 1e-4));
  double with = 0.0;
  double without = 0.0;
  for (int run = 0; run < 30; ++run) {
    const Scene scene = make_scene(random, scene_options);
    prior.T_world_camera = SE3(scene.T_world_camera.rotation(), Eigen::Vector3d::Zero());
    const SE3 T_start = moved(scene.T_world_camera, 0.001, 0.05);
    PoseOptimizerOptions options;
    options.min_inliers = 6;
    const auto a = optimize_pose(T_start, scene.matches, kCamera, options, prior);
    const auto b = optimize_pose(T_start, scene.matches, kCamera, options);
    with += geometry::local(scene.T_world_camera, a.T_world_camera).head<3>().norm();
    without += geometry::local(scene.T_world_camera, b.T_world_camera).head<3>().norm();
  }
  EXPECT_LT(with, 0.5 * without);
}

// A landmark of poor depth must pull less than its sigma in the image says.
TEST(PoseOptimizerLandmarkTest, UncertainLandmarksPullLess) {
  std::mt19937 random(10);
  std::normal_distribution<double> normal;
  double aware = 0.0;
  double naive = 0.0;
  for (int run = 0; run < 30; ++run) {
    Scene scene = make_scene(random, {.noise_px = 0.5, .depth_share = 0.0});
    const Eigen::Vector3d p_founder = scene.T_world_camera * Eigen::Vector3d(2.0, 0.5, -6.0);
    for (std::size_t i = 0; i < scene.matches.size(); i += 2) {
      auto& match = scene.matches[i];
      match.sigma_world = 2.0 * (match.p_world - p_founder).normalized();
      match.p_world += normal(random) * match.sigma_world;
    }
    auto unaware = scene.matches;
    for (auto& match : unaware) match.sigma_world.setZero();
    const auto a = optimize_pose(scene.T_world_camera, scene.matches, kCamera);
    const auto b = optimize_pose(scene.T_world_camera, unaware, kCamera);
    aware += geometry::local(scene.T_world_camera, a.T_world_camera).tail<3>().norm();
    naive += geometry::local(scene.T_world_camera, b.T_world_camera).tail<3>().norm();
  }
  EXPECT_LT(aware, 0.8 * naive);
}

}  // namespace
}  // namespace camvox::optimization
