#include "camvox/features/match.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "camvox/features/hamming.hpp"

namespace camvox::features {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

Descriptor random_descriptor(std::mt19937& random) {
  Descriptor descriptor;
  for (auto& byte : descriptor.bytes) byte = static_cast<std::uint8_t>(random());
  return descriptor;
}

Descriptor with_flipped_bits(Descriptor descriptor, int bits) {
  for (int i = 0; i < bits; ++i)
    descriptor.bytes[static_cast<std::size_t>(i / 8)] ^= static_cast<std::uint8_t>(1U << (i % 8));
  return descriptor;
}

/// Features 40 px apart with random descriptors.
FrameFeatures sparse_features(std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  FrameFeatures features;
  for (std::size_t i = 0; i < count; ++i) {
    KeyPoint key_point;
    key_point.u_px = 40.0F * static_cast<float>(i % 20);
    key_point.v_px = 40.0F * static_cast<float>(i / 20);
    key_point.octave = static_cast<std::uint8_t>(i % 8);
    key_point.angle_rad = static_cast<float>(i % 6);
    features.key_points.push_back(key_point);
    features.undistorted_px.emplace_back(key_point.u_px, key_point.v_px);
    features.descriptors.push_back(random_descriptor(random));
  }
  return features;
}

Expected expect_at(const FrameFeatures& features, std::size_t i, float radius_px) {
  Expected expected;
  expected.area.u_px = features.undistorted_px[i];
  expected.area.radius_px = radius_px;
  expected.descriptor = features.descriptors[i];
  expected.angle_rad = features.key_points[i].angle_rad;
  return expected;
}

class MatchByProjection : public ::testing::Test {
 protected:
  std::vector<Match> match(const std::vector<Expected>& expected) {
    return match_by_projection(expected, frame_, FeatureGrid(frame_), taken_, config_);
  }
  FrameFeatures frame_ = sparse_features(100, 1);
  std::vector<std::uint8_t> taken_;
  MatchConfig config_;
};

TEST_F(MatchByProjection, FindsWhatIsThere) {
  std::vector<Expected> expected;
  for (std::size_t i = 0; i < 100; ++i) {
    expected.push_back(expect_at(frame_, 99 - i, 10.0F));
    expected.back().area.u_px += Eigen::Vector2f(6.0F, -7.0F);
    expected.back().descriptor = with_flipped_bits(expected.back().descriptor, 20);
  }
  const auto matches = match(expected);
  ASSERT_EQ(matches.size(), 100U);
  for (std::uint32_t i = 0; i < 100; ++i) EXPECT_EQ(matches[i], (Match{i, 99 - i, 20}));
}

TEST_F(MatchByProjection, LooksInTheAreaAndItsOctavesOnly) {
  auto outside = expect_at(frame_, 3, 5.0F);
  outside.area.u_px.x() += 5.5F;
  auto other_octave = expect_at(frame_, 4, 5.0F);
  other_octave.area.max_octave = 3;
  EXPECT_THAT(match({outside, other_octave}), IsEmpty());
}

TEST_F(MatchByProjection, RefusesDistantDescriptors) {
  auto expected = expect_at(frame_, 5, 5.0F);
  expected.descriptor = with_flipped_bits(expected.descriptor, 101);
  EXPECT_THAT(match({expected}), IsEmpty());
  expected.descriptor = with_flipped_bits(frame_.descriptors[5], 100);
  EXPECT_EQ(match({expected}).size(), 1U);
}

TEST_F(MatchByProjection, RatioTestComparesWithinAnOctave) {
  const auto expected = expect_at(frame_, 5, 50.0F);
  frame_.descriptors[5] = with_flipped_bits(expected.descriptor, 9);
  frame_.descriptors[6] = with_flipped_bits(expected.descriptor, 10);
  EXPECT_EQ(match({expected}).size(), 1U);
  frame_.key_points[6].octave = frame_.key_points[5].octave;
  EXPECT_THAT(match({expected}), IsEmpty());
  config_.max_ratio = 1.0;
  EXPECT_EQ(match({expected}).size(), 1U);
}

TEST_F(MatchByProjection, GivesAFeatureToTheNearestQuery) {
  auto far = expect_at(frame_, 7, 5.0F);
  far.descriptor = with_flipped_bits(far.descriptor, 30);
  auto near = expect_at(frame_, 7, 5.0F);
  near.descriptor = with_flipped_bits(near.descriptor, 10);
  EXPECT_THAT(match({far, near, far}), ElementsAre(Match{1, 7, 10}));
}

TEST_F(MatchByProjection, LeavesTakenFeaturesOut) {
  taken_.assign(100, 0);
  taken_[8] = 1;
  EXPECT_THAT(match({expect_at(frame_, 8, 5.0F), expect_at(frame_, 9, 5.0F)}),
              ElementsAre(Match{1, 9, 0}));
}

TEST_F(MatchByProjection, FindsNothingInNothing) {
  EXPECT_THAT(match({}), IsEmpty());
  EXPECT_THAT(match_by_projection(std::vector{expect_at(frame_, 1, 9.0F)}, {}, {}, {}, config_),
              IsEmpty());
}

TEST(MatchByNeighbourhood, FollowsAShiftedFrame) {
  const FrameFeatures from = sparse_features(100, 2);
  FrameFeatures to = from;
  for (auto& u_px : to.undistorted_px) u_px += Eigen::Vector2f(4.0F, 3.0F);
  to.key_points[50].octave = static_cast<std::uint8_t>(from.key_points[50].octave + 2);
  const auto matches = match_by_neighbourhood(from, to, FeatureGrid(to), 5.0F, {});
  EXPECT_EQ(matches.size(), 99U);
  for (const Match& match : matches) EXPECT_EQ(match.query, match.target);
}

TEST(MatchByWords, ComparesWithinANode) {
  const FrameFeatures from = sparse_features(6, 3);
  const FrameFeatures to = from;
  const std::vector<WordEntry> words_from = {{1, 0}, {1, 2}, {3, 1}, {7, 3}, {9, 4}};
  const std::vector<WordEntry> words_to = {{1, 2}, {2, 1}, {7, 3}, {7, 5}, {8, 4}};
  EXPECT_THAT(match_by_words(from, words_from, to, words_to, {.max_distance = kStrictDistance}),
              ElementsAre(Match{2, 2, 0}, Match{3, 3, 0}));
  EXPECT_THAT(match_by_words(from, {}, to, words_to, {}), IsEmpty());
  EXPECT_THAT(match_by_words(from, words_from, to, {}, {}), IsEmpty());
}

TEST(MatchByWords, WithOneNodeEqualsASearchThroughAll) {
  FrameFeatures from = sparse_features(80, 4);
  FrameFeatures to = sparse_features(90, 5);
  for (std::size_t i = 0; i < 40; ++i) {
    to.descriptors[2 * i] = with_flipped_bits(from.descriptors[i], static_cast<int>(i));
  }
  std::vector<WordEntry> words_from, words_to;
  for (std::uint32_t i = 0; i < 80; ++i) words_from.push_back({5, i});
  for (std::uint32_t i = 0; i < 90; ++i) words_to.push_back({5, i});
  const MatchConfig config{.max_distance = 60, .max_ratio = 0.7, .check_rotation = false};
  std::vector<Match> expected;
  for (std::uint32_t i = 0; i < 80; ++i) {
    std::vector<std::pair<int, std::uint32_t>> sorted;
    for (std::uint32_t j = 0; j < 90; ++j) {
      sorted.emplace_back(hamming_distance(from.descriptors[i], to.descriptors[j]), j);
    }
    std::sort(sorted.begin(), sorted.end());
    if (sorted[0].first <= 60 && sorted[0].first < 0.7 * sorted[1].first) {
      expected.push_back({i, sorted[0].second, sorted[0].first});
    }
  }
  EXPECT_EQ(match_by_words(from, words_from, to, words_to, config), expected);
  EXPECT_EQ(expected.size(), 40U);
}

TEST(KeepConsistentRotations, DropsMatchesThatTurnOtherwise) {
  constexpr float kBin_rad = 2.0F * std::numbers::pi_v<float> / 30.0F;
  std::vector<float> angles_rad(100, 6.0F);
  std::vector<KeyPoint> targets(100);
  std::vector<Match> matches;
  for (std::uint32_t i = 0; i < 100; ++i) {
    // 80 turn by 3 bins, 12 by 4, 3 by 7, the others each otherwise.
    const float bins = i < 80   ? 3.0F
                       : i < 92 ? 4.0F
                       : i < 95 ? 7.0F
                                : 10.0F + 2.0F * static_cast<float>(i % 5);
    targets[i].angle_rad = std::fmod(6.0F + bins * kBin_rad, 2.0F * std::numbers::pi_v<float>);
    matches.push_back({i, i, 0});
  }
  keep_consistent_rotations(angles_rad, targets, matches);
  EXPECT_EQ(matches.size(), 92U);  // the third bin has less than a tenth of the fullest
  matches.clear();
  keep_consistent_rotations(angles_rad, targets, matches);
  EXPECT_THAT(matches, IsEmpty());
}

}  // namespace
}  // namespace camvox::features
