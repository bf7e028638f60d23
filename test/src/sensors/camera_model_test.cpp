#include "camvox/sensors/camera_model.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <random>

namespace camvox::sensors {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using ::testing::HasSubstr;

/// Cameras of all three models, the rig's own first, with strong and with tangential distortion.
std::vector<CameraIntrinsics> cameras() {
  CameraIntrinsics rig;
  CameraIntrinsics strong = rig;
  strong.distortion = {-0.28, 0.09, 1.1e-3, -0.7e-3, -0.012};
  CameraIntrinsics rational = rig;
  rational.distortion_model = "rational_polynomial";
  rational.distortion = {2.5, 1.2, 3e-4, -5e-4, 0.05, 2.8, 2.0, 0.25};
  CameraIntrinsics fisheye = rig;
  fisheye.distortion_model = "equidistant";
  fisheye.distortion = {-0.013, 0.021, -0.012, 0.002};
  CameraIntrinsics pinhole = rig;
  pinhole.distortion = {};
  return {rig, strong, rational, fisheye, pinhole};
}

/// Points in front of the camera, within 42 degrees of its axis.
std::vector<Vector3d> points_camera() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> slope(-0.85, 0.85);
  std::uniform_real_distribution<double> depth(0.3, 130.0);
  std::vector<Vector3d> points = {{0, 0, 1}, {1e-10, 0, 1}, {0, 1e-9, 5}};
  for (int i = 0; i < 300; ++i) {
    const double z = depth(random);
    points.emplace_back(slope(random) * z, 0.5 * slope(random) * z, z);
  }
  return points;
}

std::vector<cv::Point2d> project_with_opencv(const CameraIntrinsics& intrinsics,
                                             const std::vector<Vector3d>& points) {
  std::vector<cv::Point3d> input;
  for (const auto& p : points) input.emplace_back(p.x(), p.y(), p.z());
  const cv::Matx33d K(intrinsics.fx_px,
                      0,
                      intrinsics.cx_px,  //
                      0,
                      intrinsics.fy_px,
                      intrinsics.cy_px,
                      0,
                      0,
                      1);
  std::vector<cv::Point2d> output;
  const cv::Vec3d zero(0, 0, 0);
  if (intrinsics.distortion_model == "equidistant") {
    cv::fisheye::projectPoints(input, output, zero, zero, K, intrinsics.distortion);
  } else {
    cv::projectPoints(input, zero, zero, K, intrinsics.distortion, output);
  }
  return output;
}

TEST(CameraModel, ProjectsAsOpenCvDoes) {
  for (const auto& intrinsics : cameras()) {
    const CameraModel camera(intrinsics);
    const auto points = points_camera();
    const auto expected = project_with_opencv(intrinsics, points);
    int compared = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto u_px = camera.project(points[i]);
      if (!u_px) continue;
      ++compared;
      EXPECT_NEAR(u_px->x(), expected[i].x, 1e-9) << intrinsics.distortion_model;
      EXPECT_NEAR(u_px->y(), expected[i].y, 1e-9) << intrinsics.distortion_model;
    }
    EXPECT_GT(compared, 250) << intrinsics.distortion_model;
  }
}

TEST(CameraModel, JacobianAgreesWithFiniteDifferences) {
  for (const auto& intrinsics : cameras()) {
    const CameraModel camera(intrinsics);
    for (const auto& p_camera : points_camera()) {
      const auto projection = camera.project_with_jacobian(p_camera);
      if (!projection) continue;
      EXPECT_EQ(projection->u_px, *camera.project(p_camera));
      // Central differences in steps of 1e-6 of the depth: error about 1e-7 of a pixel per unit
      // of slope.
      const double step = 1e-6 * p_camera.z();
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d d = step * Vector3d::Unit(axis);
        const auto after = camera.project(p_camera + d);
        const auto before = camera.project(p_camera - d);
        if (!after || !before) continue;
        const Vector2d column = (*after - *before) / (2.0 * step);
        EXPECT_LT((projection->J_point.col(axis) - column).norm() * p_camera.z(), 1e-4)
            << intrinsics.distortion_model << " at " << p_camera.transpose();
      }
    }
  }
}

TEST(CameraModel, UnprojectInvertsProjectOverTheWholeImage) {
  for (const auto& intrinsics : cameras()) {
    const CameraModel camera(intrinsics);
    for (int v = 0; v < intrinsics.height_px; v += 31) {
      for (int u = 0; u < intrinsics.width_px; u += 31) {
        const Unprojection ray = camera.unproject(Vector2d(u, v));
        ASSERT_TRUE(ray.converged) << intrinsics.distortion_model << " " << u << " " << v;
        EXPECT_NEAR(ray.f_camera.norm(), 1.0, 1e-14);
        EXPECT_LT((*camera.project(7.0 * ray.f_camera) - Vector2d(u, v)).norm(), 1e-8);
        EXPECT_LE(ray.iterations, 12);
      }
    }
  }
}

TEST(CameraModel, NothingIsSeenBehindOrBeyondTheFold) {
  const CameraModel camera{CameraIntrinsics{}};
  EXPECT_FALSE(camera.project({0, 0, -1}));
  EXPECT_FALSE(camera.project({0, 0, 0}));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(camera.project({nan, 0, 1}));
  EXPECT_FALSE(camera.project_with_jacobian({0, 0, nan}));
  // With k1 = -0.3 alone the slope 1 - 0.9 r^2 vanishes at r = 1.054; a point at r = 1.5 would
  // come back into the image at r (1 - 0.3 r^2) = 0.4875.
  CameraIntrinsics folding;
  folding.distortion = {-0.3};
  const CameraModel fold(folding);
  EXPECT_TRUE(fold.project({1.05, 0, 1}));
  EXPECT_FALSE(fold.project({1.06, 0, 1}));
  EXPECT_FALSE(fold.project({1.5, 0, 1}));
}

TEST(CameraModel, UnprojectReportsWhatItCannotInvert) {
  // The distorted radius of k1 = -0.3 is at most 0.7027: farther out no direction exists.
  CameraIntrinsics folding;
  folding.distortion = {-0.3};
  const CameraModel camera(folding);
  EXPECT_TRUE(camera.unproject({790.335 + 957.994 * 0.69, 250.663}).converged);
  const Unprojection outside = camera.unproject({790.335 + 957.994 * 0.75, 250.663});
  EXPECT_FALSE(outside.converged);
  EXPECT_FALSE(camera.unproject({std::numeric_limits<double>::quiet_NaN(), 0}).converged);
}

TEST(CameraModel, ContainsUsesPixelCentres) {
  const CameraModel camera{CameraIntrinsics{}};
  EXPECT_TRUE(camera.contains({0, 0}));
  EXPECT_TRUE(camera.contains({1519, 567}));
  EXPECT_FALSE(camera.contains({1519.01, 567}));
  EXPECT_FALSE(camera.contains({-0.01, 0}));
  EXPECT_FALSE(camera.contains({9, 100}, 10));
  EXPECT_FALSE(camera.contains({std::numeric_limits<double>::quiet_NaN(), 0}));
}

TEST(CameraModel, BadIntrinsicsGiveAllProblems) {
  CameraIntrinsics bad;
  bad.fx_px = 0.0;
  bad.width_px = 0;
  bad.distortion = {1, 2, 3, 4, 5, 6};
  try {
    const CameraModel camera(bad);
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 3u);
    EXPECT_THAT(error.what(), HasSubstr("fx_px"));
    EXPECT_THAT(error.what(), HasSubstr("plumb_bob has at most 5"));
  }
  bad = {};
  bad.distortion_model = "fisheye";
  EXPECT_THROW(CameraModel{bad}, config::ConfigError);
}

}  // namespace
}  // namespace camvox::sensors
