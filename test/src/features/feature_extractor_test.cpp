#include "camvox/features/feature_extractor.hpp"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <set>
#include <stdexcept>
#include <tuple>

#include "camvox/features/orientation.hpp"
#include "test_images.hpp"

namespace camvox::features {
namespace {

TEST(FeatureExtractor, GivesTheWantedNumberOnAllLevels) {
  ExtractorConfig config;
  config.features = 500;
  const FrameFeatures features = FeatureExtractor(config).extract(block_image(640, 480, 1).view());
  EXPECT_EQ(features.size(), 500U);
  EXPECT_EQ(features.descriptors.size(), 500U);
  EXPECT_TRUE(features.undistorted_px.empty());
  std::array<int, 8> counts{};
  for (const KeyPoint& key_point : features.key_points) ++counts.at(key_point.octave);
  // A geometric series: 109 on the finest level, 30 on the coarsest.
  EXPECT_NEAR(counts[0], 109, 2);
  EXPECT_NEAR(counts[7], 30, 2);
}

TEST(FeatureExtractor, FinerLevelsGiveWhatCoarseOnesLack) {
  ExtractorConfig config;
  config.features = 150;
  // The coarsest levels have no room for a patch.
  const auto features = FeatureExtractor(config).extract(noise_image(130, 110, 3).view());
  EXPECT_EQ(features.size(), 150U);
}

TEST(FeatureExtractor, EveryFeatureIsDescribedWhereItIs) {
  const TestImage image = block_image(320, 240, 2);
  FeatureExtractor extractor(ExtractorConfig{});
  const FrameFeatures features = extractor.extract(image.view());
  ASSERT_GT(features.size(), 300U);
  ImagePyramid pyramid(8, 1.2);
  pyramid.build(image.view());
  const DescriptorExtractor descriptors;
  std::set<std::tuple<int, float, float>> places;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const KeyPoint& key_point = features.key_points[i];
    const double scale = std::pow(1.2, key_point.octave);
    const double u = (key_point.u_px + 0.5) / scale - 0.5;
    const double v = (key_point.v_px + 0.5) / scale - 0.5;
    // A corner is moved by less than half a pixel, or half a pixel back when two are equal. At the
    // edge of the image the stronger neighbour may be out of bounds: either pixel may be meant.
    const bool at_edge = u < 20 || v < 20 || u > pyramid.level(key_point.octave).width_px - 21 ||
                         v > pyramid.level(key_point.octave).height_px - 21;
    places.insert({key_point.octave, key_point.u_px, key_point.v_px});
    if (at_edge) continue;
    const int level_u = static_cast<int>(std::floor(u + 0.501));
    const int level_v = static_cast<int>(std::floor(v + 0.501));
    const ImageView& level = pyramid.level(key_point.octave);
    const Corner corner{static_cast<std::uint16_t>(level_u), static_cast<std::uint16_t>(level_v)};
    EXPECT_NEAR(u - level_u, refine_corner(level, corner).du_px, 1e-3);
    EXPECT_NEAR(v - level_v, refine_corner(level, corner).dv_px, 1e-3);
    EXPECT_EQ(key_point.angle_rad, orientation_rad(level, level_u, level_v));
    EXPECT_EQ(features.descriptors[i],
              descriptors.describe(level, level_u, level_v, key_point.angle_rad));
  }
  EXPECT_EQ(places.size(), features.size());
}

TEST(FeatureExtractor, RepeatsItselfWhateverCameBefore) {
  FeatureExtractor used(ExtractorConfig{});
  for (const TestImage& image : test_images()) {
    FrameFeatures first;
    used.extract(image.view(), first);
    const FrameFeatures second = FeatureExtractor(ExtractorConfig{}).extract(image.view());
    ASSERT_EQ(first.size(), second.size());
    EXPECT_EQ(first.descriptors, second.descriptors);
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(first.key_points[i].u_px, second.key_points[i].u_px);
      EXPECT_EQ(first.key_points[i].angle_rad, second.key_points[i].angle_rad);
    }
  }
}

TEST(FeatureExtractor, FindsNothingWhereNothingIs) {
  FeatureExtractor extractor(ExtractorConfig{});
  for (const TestImage& image :
       {flat_image(640, 480), flat_image(640, 480, 255), noise_image(38, 38, 1)}) {
    FrameFeatures features;
    features.key_points.resize(7);
    features.depth_m.resize(7);
    extractor.extract(image.view(), features);
    EXPECT_EQ(features.size(), 0U);
    EXPECT_TRUE(features.depth_m.empty());
  }
  EXPECT_EQ(extractor.extract({}).size(), 0U);
}

TEST(FeatureExtractor, RefusesBrokenInput) {
  ExtractorConfig config;
  config.features = 0;
  config.levels = 40;
  try {
    FeatureExtractor extractor(config);
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 2U);
  }
  FeatureExtractor extractor(ExtractorConfig{});
  const TestImage image = noise_image(100, 100, 1);
  EXPECT_THROW((void)extractor.extract({image.pixels.data(), 100, 100, 99}), std::logic_error);
  EXPECT_THROW((void)extractor.extract({image.pixels.data(), 70000, 1, 70000}), std::logic_error);
}

}  // namespace
}  // namespace camvox::features
