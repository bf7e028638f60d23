#include "camvox/features/image_pyramid.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "test_images.hpp"

namespace camvox::features {
namespace {

/// Bilinear interpolation in the fixed point of the pyramid: rows first, both rounded.
int slow_pixel(const ImageView& from, double scale, int u, int v) {
  const auto split = [&](int place, int size) {
    const double position = (place + 0.5) * scale - 0.5;
    const int first = std::min(static_cast<int>(position), size - 2);
    return std::pair{first, static_cast<int>(std::lround((position - first) * 128))};
  };
  const auto [u0, wu] = split(u, from.width_px);
  const auto [v0, wv] = split(v, from.height_px);
  const auto column = [&, v0 = v0, wv = wv](int at) {
    return (*from.at(at, v0) * (128 - wv) + *from.at(at, v0 + 1) * wv + 64) / 128;
  };
  return (column(u0) * (128 - wu) + column(u0 + 1) * wu + 64) / 128;
}

TEST(ImagePyramid, EveryLevelIsTheOneBeforeMadeSmaller) {
  for (const double scale : {1.2, 1.05, 1.37, 1.7}) {
    ImagePyramid pyramid(6, scale);
    for (const TestImage& image :
         {noise_image(200, 101, 1), block_image(123, 177, 2), noise_image(17, 16, 3)}) {
      pyramid.build(image.view());
      EXPECT_EQ(pyramid.level(0).data, image.pixels.data());
      for (int l = 1; l < 6; ++l) {
        const ImageView& level = pyramid.level(l);
        const ImageView& from = pyramid.level(l - 1);
        if (level.width_px == 0) continue;
        EXPECT_EQ(level.width_px, static_cast<int>(from.width_px / scale));
        EXPECT_EQ(level.height_px, static_cast<int>(from.height_px / scale));
        for (int v = 0; v < level.height_px; ++v) {
          for (int u = 0; u < level.width_px; ++u) {
            ASSERT_EQ(*level.at(u, v), slow_pixel(from, scale, u, v)) << l << " " << u << " " << v;
          }
        }
      }
    }
  }
}

TEST(ImagePyramid, KeepsPlaces) {
  // A slope of one grey level a pixel stays the same function of the place in the full image.
  const TestImage image(256, 60, [](int u, int) { return u; });
  ImagePyramid pyramid(8, 1.2);
  pyramid.build(image.view());
  for (int l = 0; l < 8; ++l) {
    const ImageView& level = pyramid.level(l);
    EXPECT_NEAR(pyramid.scale(l), std::pow(1.2, l), 1e-12);
    double error = 0.0;
    for (int u = 5; u < level.width_px - 5; ++u) {
      const double place_px = (u + 0.5) * pyramid.scale(l) - 0.5;
      error += (*level.at(u, level.height_px / 2) - place_px) / (level.width_px - 10);
    }
    // Each level rounds half levels up. Centres out of line would give 1.3 on the last.
    EXPECT_NEAR(error, 0.0, 0.5) << l;
  }
}

TEST(ImagePyramid, LevelsTooSmallAreEmpty) {
  ImagePyramid pyramid(8, 1.2);
  pyramid.build(noise_image(20, 20, 1).view());
  EXPECT_EQ(pyramid.level(7).width_px, 0);
  pyramid.build({});
  EXPECT_EQ(pyramid.level(1).width_px, 0);
}

}  // namespace
}  // namespace camvox::features
