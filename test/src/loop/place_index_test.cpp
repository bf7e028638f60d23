#include "camvox/loop/place_index.hpp"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>

#include "camvox/test/feature_world.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;
using features::FrameFeatures;
using test::FeatureWorld;

FrameFeatures features_of(const std::vector<Descriptor>& descriptors) {
  FrameFeatures features;
  features.descriptors = descriptors;
  features.key_points.resize(descriptors.size());
  return features;
}

FrameFeatures random_features(std::mt19937& random, int count) {
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < count; ++i) descriptors.push_back(FeatureWorld::random_descriptor(random));
  return features_of(descriptors);
}

/// The same with a share of the bits wrong.
FrameFeatures seen_again(FrameFeatures features, std::mt19937& random, unsigned one_in) {
  for (auto& descriptor : features.descriptors) {
    for (unsigned bit = 0; bit < 256; ++bit) {
      auto& byte = descriptor.bytes[bit / 8];
      if (random() % one_in == 0) byte = static_cast<std::uint8_t>(byte ^ (1U << (bit % 8)));
    }
  }
  return features;
}

TEST(PlaceIndexTest, FindsEveryPlaceAgain) {
  std::mt19937 random(1);
  PlaceIndex index;
  std::vector<FrameFeatures> places;
  for (std::uint64_t id = 1; id <= 100; ++id) {
    places.push_back(random_features(random, 200));
    index.insert(id, places.back());
  }
  EXPECT_EQ(index.descriptors(), 20000U);
  for (std::uint64_t id = 1; id <= 100; ++id) {
    const auto scores = index.query(seen_again(places[id - 1], random, 12));
    ASSERT_FALSE(scores.empty());
    EXPECT_EQ(scores.front().keyframe_id, id);
    // Random descriptors have no groups, so the tree cuts where it must: the worst case for it.
    // Two leaves must still find a fifth of what all with all would find.
    EXPECT_GT(scores.front().matches, 40);
    if (scores.size() > 1) {
      EXPECT_LT(scores[1].matches, 5);
    }
  }
}

// While the tree is one leaf, the index is the brute-force search.
TEST(PlaceIndexTest, OneLeafFindsAll) {
  std::mt19937 random(2);
  PlaceIndexConfig config;
  config.leaf_capacity = 4096;
  PlaceIndex index(config);
  const auto place = random_features(random, 300);
  index.insert(7, place);
  index.insert(8, random_features(random, 300));
  EXPECT_EQ(index.query(seen_again(place, random, 16)).front().matches, 300);
}

TEST(PlaceIndexTest, RareDescriptorsWeighMore) {
  std::mt19937 random(3);
  PlaceIndex index;
  const auto common = random_features(random, 50);
  auto both = common;
  const auto rare = random_features(random, 50);
  for (std::uint64_t id = 1; id <= 20; ++id) index.insert(id, common);
  index.insert(21, rare);
  both.descriptors.insert(both.descriptors.end(), rare.descriptors.begin(), rare.descriptors.end());
  both.key_points.resize(100);
  EXPECT_EQ(index.query(both).front().keyframe_id, 21U);
}

TEST(PlaceIndexTest, ForgetsWhatIsRemoved) {
  std::mt19937 random(4);
  PlaceIndex index;
  const auto place = random_features(random, 200);
  index.insert(1, place);
  index.insert(2, place);
  index.remove(1);
  index.remove(99);
  EXPECT_EQ(index.keyframes(), 1U);
  EXPECT_EQ(index.descriptors(), 200U);
  const auto scores = index.query(place);
  ASSERT_EQ(scores.size(), 1U);
  EXPECT_EQ(scores[0].keyframe_id, 2U);
  index.insert(1, place);  // may come again
  EXPECT_EQ(index.query(place).size(), 2U);
}

// Facades that are all the same must not make one endless leaf.
TEST(PlaceIndexTest, IdenticalDescriptorsStayBounded) {
  std::mt19937 random(5);
  PlaceIndex index;
  const auto one = FeatureWorld::random_descriptor(random);
  const auto place = features_of(std::vector<Descriptor>(200, one));
  for (std::uint64_t id = 1; id <= 200; ++id) index.insert(id, place);
  EXPECT_LT(index.bytes(), 200000U);  // not 200 * 200 * 36 bytes
  EXPECT_FALSE(index.query(place).empty());
}

TEST(PlaceIndexTest, TheSameAgain) {
  const auto build = [] {
    std::mt19937 random(6);
    PlaceIndex index;
    for (std::uint64_t id = 1; id <= 40; ++id) index.insert(id, random_features(random, 300));
    return index.query(random_features(random, 300));
  };
  const auto first = build();
  const auto second = build();
  ASSERT_EQ(first.size(), second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    EXPECT_EQ(first[i].keyframe_id, second[i].keyframe_id);
    EXPECT_EQ(first[i].score, second[i].score);
  }
}

TEST(PlaceIndexTest, EmptyAndTwice) {
  PlaceIndex index;
  EXPECT_TRUE(index.query({}).empty());
  index.insert(1, {});
  EXPECT_TRUE(index.query({}).empty());
  EXPECT_THROW(index.insert(1, {}), std::logic_error);
  PlaceIndexConfig config;
  config.branches = 1;
  EXPECT_THROW(PlaceIndex{config}, config::ConfigError);
}

TEST(StrongestFeaturesTest, TakesTheStrongestInOrder) {
  FrameFeatures features;
  for (const float response : {3.0F, 9.0F, 1.0F, 9.0F, 5.0F}) {
    features.key_points.push_back({0.0F, 0.0F, 0.0F, response, 0});
  }
  EXPECT_EQ(strongest_features(features, 3), (std::vector<std::size_t>{1, 3, 4}));
  EXPECT_EQ(strongest_features(features, 9).size(), 5U);
}

}  // namespace
}  // namespace camvox::loop
