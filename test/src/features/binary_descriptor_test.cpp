#include "camvox/features/binary_descriptor.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <set>
#include <tuple>

#include "camvox/features/hamming.hpp"
#include "test_images.hpp"

namespace camvox::features {
namespace {

int slow_smooth(const TestImage& image, int u, int v) {
  constexpr int kWeights[7] = {1, 2, 3, 3, 3, 2, 1};
  int sum = 0;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) sum += kWeights[i + 3] * kWeights[j + 3] * image.at(u + j, v + i);
  }
  return sum;
}

Descriptor slow_descriptor(const TestImage& image, int u, int v, int angle_index) {
  const double angle_rad = 2.0 * std::numbers::pi * angle_index / DescriptorExtractor::kAngles;
  const auto sample = [&](int du, int dv) {
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    return slow_smooth(image,
                       u + static_cast<int>(std::lround(c * du - s * dv)),
                       v + static_cast<int>(std::lround(s * du + c * dv)));
  };
  Descriptor descriptor;
  for (std::size_t i = 0; i < 256; ++i) {
    const PixelPair& pair = sampling_pattern()[i];
    if (sample(pair.du_a, pair.dv_a) < sample(pair.du_b, pair.dv_b)) {
      descriptor.bytes[i / 8] |= static_cast<std::uint8_t>(1U << (i % 8));
    }
  }
  return descriptor;
}

TEST(SamplingPattern, HasDistinctPairsWithinThePatch) {
  std::set<std::tuple<int, int, int, int>> pairs;
  for (const PixelPair& p : sampling_pattern()) {
    EXPECT_LE(p.du_a * p.du_a + p.dv_a * p.dv_a, 225);
    EXPECT_LE(p.du_b * p.du_b + p.dv_b * p.dv_b, 225);
    EXPECT_TRUE(p.du_a != p.du_b || p.dv_a != p.dv_b);
    pairs.insert({p.du_a, p.dv_a, p.du_b, p.dv_b});
    pairs.insert({p.du_b, p.dv_b, p.du_a, p.dv_a});
  }
  EXPECT_EQ(pairs.size(), 512U);
}

TEST(DescriptorExtractor, SmoothsAsTheDefinitionSays) {
  for (const TestImage& image : {noise_image(64, 64, 1, 200.0), flat_image(64, 64, 255)}) {
    DescriptorExtractor::Patch patch;
    smooth_patch(image.view(), 30, 31, patch);
    for (int v = 0; v < 31; ++v) {
      for (int u = 0; u < 31; ++u) {
        ASSERT_EQ(patch[static_cast<std::size_t>(DescriptorExtractor::place(u, v))],
                  slow_smooth(image, 15 + u, 16 + v));
      }
    }
  }
}

TEST(DescriptorExtractor, DescribesAsTheDefinitionSays) {
  const DescriptorExtractor extractor;
  const TestImage image = block_image(90, 70, 11);
  for (int index = 0; index < DescriptorExtractor::kAngles; index += 5) {
    const auto angle_rad =
        static_cast<float>(2.0 * std::numbers::pi * index / DescriptorExtractor::kAngles);
    const int u = 19 + index % 40;
    const int v = 19 + index % 30;
    EXPECT_EQ(extractor.describe(image.view(), u, v, angle_rad),
              slow_descriptor(image, u, v, index));
  }
}

TEST(DescriptorExtractor, TakesTheNearestAngle) {
  const double step_rad = 2.0 * std::numbers::pi / DescriptorExtractor::kAngles;
  EXPECT_EQ(DescriptorExtractor::angle_index(0.0F), 0);
  EXPECT_EQ(DescriptorExtractor::angle_index(static_cast<float>(0.49 * step_rad)), 0);
  EXPECT_EQ(DescriptorExtractor::angle_index(static_cast<float>(0.51 * step_rad)), 1);
  EXPECT_EQ(DescriptorExtractor::angle_index(static_cast<float>(127.4 * step_rad)), 127);
  EXPECT_EQ(DescriptorExtractor::angle_index(static_cast<float>(127.6 * step_rad)), 0);
}

TEST(DescriptorExtractor, TurnsWithThePatch) {
  // A quarter turn maps pixels onto pixels: the descriptor stays the same bit by bit.
  const TestImage image = noise_image(61, 61, 5);
  const TestImage turned(61, 61, [&](int u, int v) { return image.at(v, 60 - u); });
  const DescriptorExtractor extractor;
  const auto quarter_rad = static_cast<float>(std::numbers::pi / 2.0);
  const Descriptor before = extractor.describe(image.view(), 30, 30, 0.0F);
  EXPECT_EQ(extractor.describe(turned.view(), 30, 30, quarter_rad), before);
  EXPECT_GT(hamming_distance(extractor.describe(turned.view(), 30, 30, 0.0F), before), 60);
}

}  // namespace
}  // namespace camvox::features
