#include "camvox/depth/sample_depth.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <limits>
#include <vector>

namespace camvox::depth {
namespace {

struct Image {
  explicit Image(const std::function<float(int u, int v)>& depth) {
    for (int v = 0; v < 32; ++v) {
      for (int u = 0; u < 48; ++u) {
        depth_m.push_back(depth(u, v));
        sigma_m.push_back(depth_m.back() > 0.0F ? 0.01F : 0.0F);
      }
    }
  }
  [[nodiscard]] DepthView view() const { return {depth_m.data(), sigma_m.data(), 48, 32}; }

  std::vector<float> depth_m;
  std::vector<float> sigma_m;
};

TEST(SampleDepth, EmptyImageGivesNothing) {
  EXPECT_EQ(sample_depth({}, 0.0F, 0.0F, 3).depth_m, 0.0F);
  const Image image([](int, int) { return 0.0F; });
  EXPECT_EQ(sample_depth(image.view(), 20.0F, 10.0F, 8).depth_m, 0.0F);
}

TEST(SampleDepth, OutsideTheImageAndNanGiveNothing) {
  const Image image([](int, int) { return 5.0F; });
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const auto& [u, v] :
       {std::pair{-0.6F, 3.0F}, {47.6F, 3.0F}, {3.0F, 31.6F}, {nan, 3.0F}, {3.0F, nan}}) {
    EXPECT_EQ(sample_depth(image.view(), u, v, 3).depth_m, 0.0F) << u << ' ' << v;
  }
  EXPECT_NEAR(sample_depth(image.view(), -0.4F, 31.4F, 3).depth_m, 5.0F, 1e-5F);
}

/// A plane is linear in inverse depth; the stiffness of the fit leaves a little of the slope out
/// where the window is cut by the border, so the check stays inside.
TEST(SampleDepth, SlopeIsInterpolatedBetweenPixels) {
  const auto inverse = [](float u, float v) { return 0.05F + 0.001F * u + 0.002F * v; };
  const Image image(
      [&](int u, int v) { return 1.0F / inverse(static_cast<float>(u), static_cast<float>(v)); });
  const DepthSample sample = sample_depth(image.view(), 20.3F, 12.6F, 2);
  EXPECT_NEAR(sample.depth_m, 1.0F / inverse(20.3F, 12.6F), 0.01F);
  EXPECT_GT(sample.sigma_m, 0.0099F);
  EXPECT_LT(sample.sigma_m, 0.05F);
}

TEST(SampleDepth, NearerSurfaceWinsAtAnEdge) {
  const Image image([](int u, int) { return u < 20 ? 4.0F : 9.0F; });
  for (const float u : {19.0F, 20.0F, 21.0F, 22.4F}) {
    EXPECT_NEAR(sample_depth(image.view(), u, 12.0F, 3).depth_m, 4.0F, 1e-4F) << u;
  }
  EXPECT_NEAR(sample_depth(image.view(), 24.0F, 12.0F, 3).depth_m, 9.0F, 1e-4F);
}

TEST(SampleDepth, NearestOfThreeSurfacesWins) {
  const Image image([](int u, int) { return u < 20 ? 4.0F : u < 22 ? 30.0F : 60.0F; });
  EXPECT_NEAR(sample_depth(image.view(), 21.0F, 12.0F, 3).depth_m, 4.0F, 1e-4F);
}

TEST(SampleDepth, GapBetweenSurfacesTakesTheNearerOneNeverTheMiddle) {
  const Image image([](int u, int) { return u < 19 ? 4.0F : u < 23 ? 0.0F : 9.0F; });
  EXPECT_NEAR(sample_depth(image.view(), 21.0F, 12.0F, 3).depth_m, 4.0F, 1e-4F);
}

TEST(SampleDepth, OneStrayPixelIsNoSurface) {
  const Image image([](int u, int v) { return u == 20 && v == 12 ? 2.0F : 9.0F; });
  EXPECT_EQ(sample_depth(image.view(), 21.0F, 12.0F, 3).depth_m, 0.0F);
  EXPECT_NEAR(sample_depth(image.view(), 26.0F, 12.0F, 3).depth_m, 9.0F, 1e-4F);
}

TEST(SampleDepth, JumbleGivesNothing) {
  const Image image(
      [](int u, int v) { return 3.0F + 0.8F * static_cast<float>((u * 7 + v * 5) % 6); });
  EXPECT_EQ(sample_depth(image.view(), 20.0F, 12.0F, 3).depth_m, 0.0F);
}

TEST(SampleDepth, FartherFromTheReturnsIsLessSure) {
  const Image image(
      [](int u, int) { return u < 20 ? 1.0F / (0.05F + 0.002F * static_cast<float>(u)) : 0.0F; });
  const float at = sample_depth(image.view(), 19.0F, 12.0F, 4).sigma_m;
  const float beyond = sample_depth(image.view(), 22.5F, 12.0F, 4).sigma_m;
  EXPECT_GT(beyond, 1.5F * at);
}

TEST(SampleDepth, RadiusZeroIsThePixel) {
  const Image image([](int u, int) { return u < 20 ? 4.0F : 9.0F; });
  EXPECT_EQ(sample_depth(image.view(), 19.6F, 12.0F, 0).depth_m, 9.0F);
}

}  // namespace
}  // namespace camvox::depth
