#include "camvox/features/feature_grid.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace camvox::features {
namespace {

FrameFeatures random_features(std::size_t count) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> u(-30.0F, 1500.0F);
  std::uniform_real_distribution<float> v(5.0F, 500.0F);
  FrameFeatures features;
  for (std::size_t i = 0; i < count; ++i) {
    KeyPoint key_point;
    key_point.octave = static_cast<std::uint8_t>(random() % 8);
    features.key_points.push_back(key_point);
    features.descriptors.emplace_back();
    features.undistorted_px.emplace_back(u(random), v(random));
  }
  return features;
}

std::vector<std::uint32_t> search_all(const FrameFeatures& features, const SearchArea& area) {
  std::vector<std::uint32_t> found;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Eigen::Vector2f away = (features.undistorted_px[i] - area.u_px).cwiseAbs();
    const int octave = features.key_points[i].octave;
    const bool inside =
        away.maxCoeff() <= area.radius_px && octave >= area.min_octave && octave <= area.max_octave;
    if (inside) found.push_back(static_cast<std::uint32_t>(i));
  }
  return found;
}

TEST(FeatureGrid, FindsWhatASearchThroughAllFinds) {
  for (const std::size_t count : {1U, 2U, 40U, 1500U}) {
    const FrameFeatures features = random_features(count);
    const FeatureGrid grid(features);
    std::mt19937 random(5);
    std::uniform_real_distribution<float> place(-200.0F, 1700.0F);
    for (int i = 0; i < 200; ++i) {
      const SearchArea area{{place(random), 0.4F * place(random)},
                            static_cast<float>(random() % 200),
                            static_cast<int>(random() % 8) - 1,
                            static_cast<int>(random() % 9)};
      auto found = grid.find(area);
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, search_all(features, area));
    }
  }
}

TEST(FeatureGrid, TakesRawPixelsWhenNothingIsUndistorted) {
  FrameFeatures features;
  features.key_points.push_back({.u_px = 10.0F, .v_px = 20.0F});
  EXPECT_EQ(FeatureGrid(features).find({{11.0F, 20.0F}, 2.0F}).size(), 1U);
  EXPECT_TRUE(FeatureGrid(features).find({{13.0F, 20.0F}, 2.0F}).empty());
}

TEST(FeatureGrid, FindsNothingInNothing) {
  EXPECT_TRUE(FeatureGrid().find({{0.0F, 0.0F}, 1e6F}).empty());
  EXPECT_TRUE(FeatureGrid(FrameFeatures{}).find({{0.0F, 0.0F}, 1e6F}).empty());
  const FeatureGrid grid(random_features(100));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(grid.find({{nan, 100.0F}, 50.0F}).empty());
  EXPECT_TRUE(grid.find({{100.0F, 100.0F}, nan}).empty());
  EXPECT_TRUE(grid.find({{100.0F, 100.0F}, -1.0F}).empty());
  EXPECT_EQ(grid.find({{100.0F, 100.0F}, 1e30F}).size(), 100U);
}

}  // namespace
}  // namespace camvox::features
