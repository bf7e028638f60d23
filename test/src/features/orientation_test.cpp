#include "camvox/features/orientation.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "test_images.hpp"

namespace camvox::features {
namespace {

Moments slow_moments(const TestImage& image, int u, int v) {
  Moments moments;
  for (int dv = -15; dv <= 15; ++dv) {
    for (int du = -15; du <= 15; ++du) {
      if (du * du + dv * dv > 15.5 * 15.5) continue;
      moments.m10 += du * image.at(u + du, v + dv);
      moments.m01 += dv * image.at(u + du, v + dv);
    }
  }
  return moments;
}

TEST(Orientation, MomentsEqualTheirDefinition) {
  for (const TestImage& image : {noise_image(80, 60, 1), noise_image(50, 50, 2, 500.0)}) {
    for (int v = 15; v < image.height_px - 15; v += 3) {
      for (int u = 15; u < image.width_px - 16; ++u) {
        const Moments expected = slow_moments(image, u, v);
        const Moments moments = patch_moments(image.view(), u, v);
        ASSERT_EQ(moments.m10, expected.m10);
        ASSERT_EQ(moments.m01, expected.m01);
      }
    }
  }
}

TEST(Orientation, ExtremeContrastDoesNotOverflow) {
  const TestImage image(64, 64, [](int u, int v) { return u > 32 || v > 32 ? 255 : 0; });
  const TestImage lower(64, 64, [](int, int v) { return v > 32 ? 255 : 0; });
  const TestImage upper(64, 64, [](int, int v) { return v < 32 ? 255 : 0; });
  for (const auto& extreme : {image, lower, upper}) {
    EXPECT_EQ(patch_moments(extreme.view(), 32, 32).m01, slow_moments(extreme, 32, 32).m01);
    EXPECT_EQ(patch_moments(extreme.view(), 32, 32).m10, slow_moments(extreme, 32, 32).m10);
  }
}

TEST(Orientation, PointsFromTheCentreToTheBrightSide) {
  for (int degrees = 0; degrees < 360; degrees += 15) {
    const double angle_rad = degrees * std::numbers::pi / 180.0;
    const TestImage image(64, 64, [&](int u, int v) {
      return static_cast<int>(
          std::lround(128 + 4 * ((u - 32) * std::cos(angle_rad) + (v - 32) * std::sin(angle_rad))));
    });
    const double error_rad = orientation_rad(image.view(), 32, 32) - angle_rad;
    // Grey levels are rounded: half a level of a slope of 4 a pixel, averaged over 700 pixels.
    EXPECT_LT(std::abs(std::remainder(error_rad, 2 * std::numbers::pi)), 0.01) << degrees;
  }
}

TEST(Orientation, IsZeroForFlatPatchesAndInRangeForAll) {
  EXPECT_EQ(orientation_rad(flat_image(40, 40, 200).view(), 20, 20), 0.0F);
  const TestImage image = noise_image(200, 60, 3);
  for (int u = 20; u < 180; ++u) {
    const float angle_rad = orientation_rad(image.view(), u, 30);
    EXPECT_GE(angle_rad, 0.0F);
    EXPECT_LT(angle_rad, 2.0F * std::numbers::pi_v<float>);
  }
}

}  // namespace
}  // namespace camvox::features
