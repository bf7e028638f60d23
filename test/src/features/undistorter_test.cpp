#include "camvox/features/undistorter.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <random>

namespace camvox::features {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;
using sensors::CameraIntrinsics;
using sensors::CameraModel;

CameraIntrinsics camera(const std::string& model, const std::vector<double>& distortion) {
  CameraIntrinsics intrinsics;
  intrinsics.distortion_model = model;
  intrinsics.distortion = distortion;
  return intrinsics;
}

std::vector<CameraIntrinsics> cameras() {
  CameraIntrinsics wide = camera("equidistant", {-0.013, 0.021, -0.012, 0.002});
  wide.fx_px = wide.fy_px = 480.0;  // 80 degrees to each side
  return {camera("plumb_bob", {}),
          camera("plumb_bob", {-0.12, 0.1162, 0.0, 0.0, 0.0}),
          camera("plumb_bob", {-0.28, 0.09, 1.1e-3, -0.7e-3, -0.012}),
          camera("rational_polynomial", {2.5, 1.2, 3e-4, -5e-4, 0.05, 2.8, 2.0, 0.25}),
          camera("equidistant", {-0.013, 0.021, -0.012, 0.002}),
          wide};
}

std::optional<Vector2d> exact(const CameraModel& model, const Vector2f& u_px) {
  const auto ray = model.unproject(u_px.cast<double>());
  if (!ray.converged) return std::nullopt;
  const auto& k = model.intrinsics();
  return Vector2d(k.fx_px * ray.f_camera.x() / ray.f_camera.z() + k.cx_px,
                  k.fy_px * ray.f_camera.y() / ray.f_camera.z() + k.cy_px);
}

TEST(Undistorter, AgreesWithTheCameraModel) {
  for (const CameraIntrinsics& intrinsics : cameras()) {
    const CameraModel model(intrinsics);
    const Undistorter undistorter(model);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> u(-0.5F, static_cast<float>(intrinsics.width_px) - 0.5F);
    std::uniform_real_distribution<float> v(-0.5F, static_cast<float>(intrinsics.height_px) - 0.5F);
    double worst_px = 0.0;
    for (int i = 0; i < 3000; ++i) {
      const Vector2f u_px(u(random), v(random));
      const auto expected = exact(model, u_px);
      const auto straight_px = undistorter.undistort(u_px);
      ASSERT_EQ(straight_px.has_value(), expected.has_value()) << u_px.transpose();
      if (!expected) continue;
      const double tolerance_px = 1e-6 * expected->norm();  // of a float
      worst_px =
          std::max(worst_px, (straight_px->cast<double>() - *expected).norm() - tolerance_px);
    }
    // The table is checked in the middle of its cells to 0.01 px.
    EXPECT_LT(worst_px, 0.015) << intrinsics.distortion_model << " "
                               << intrinsics.distortion.size();
  }
}

TEST(Undistorter, UsesTheTableNearlyEverywhereForTheRig) {
  EXPECT_EQ(Undistorter(CameraModel(cameras()[0])).table_share(), 1.0);
  for (const std::size_t i : {1U, 2U, 3U, 4U}) {
    EXPECT_GT(Undistorter(CameraModel(cameras()[i])).table_share(), 0.99) << i;
  }
}

TEST(Undistorter, RemovesFeaturesThatCannotBeSeen) {
  // Such a strong barrel folds at radius 0.745 (distorted 0.496): the image reaches beyond.
  const CameraModel model(camera("plumb_bob", {-0.6}));
  const Undistorter undistorter(model);
  FrameFeatures features;
  for (int i = 0; i < 4; ++i) {
    const auto u_px = static_cast<float>(i == 1 ? 5.0 : 700.0 + i);
    features.key_points.push_back({.u_px = u_px, .v_px = 250.0F});
    features.descriptors.emplace_back();
    features.descriptors.back().bytes[0] = static_cast<std::uint8_t>(i);
    features.depth_m.push_back(static_cast<float>(i));
    features.depth_sigma_m.push_back(0.1F);
  }
  undistorter.undistort(features);
  ASSERT_EQ(features.size(), 3U);
  EXPECT_EQ(features.undistorted_px.size(), 3U);
  EXPECT_EQ(features.descriptors[1].bytes[0], 2);
  EXPECT_THAT(features.depth_m, ::testing::ElementsAre(0.0F, 2.0F, 3.0F));
  EXPECT_EQ(features.depth_sigma_m.size(), 3U);
}

TEST(Undistorter, KnowsNothingOutsideTheImage) {
  const Undistorter undistorter{CameraModel(cameras()[1])};
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(undistorter.undistort({-2.0F, 10.0F}));
  EXPECT_FALSE(undistorter.undistort({10.0F, 5000.0F}));
  EXPECT_FALSE(undistorter.undistort({nan, 10.0F}));
}

}  // namespace
}  // namespace camvox::features
