#include "rigid_ransac.hpp"

#include <gtest/gtest.h>

#include <random>

namespace camvox::loop {
namespace {

using geometry::SE3;

std::vector<PointPair> moved_points(const SE3& T_place_query, int count, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-5.0, 5.0);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3d p(unit(random), unit(random), unit(random));
    pairs.push_back({T_place_query * p, p, 0.05});
  }
  return pairs;
}

const SE3 kTruth(geometry::SO3::exp({0.3, -2.0, 0.8}), {1.0, 2.0, -3.0});

TEST(RigidRansacTest, AlignsExactPoints) {
  std::mt19937 random(1);
  const auto T = align_points(moved_points(kTruth, 5, random));
  ASSERT_TRUE(T);
  EXPECT_LT(geometry::local(kTruth, *T).norm(), 1e-12);
}

TEST(RigidRansacTest, NoMotionFromALineOrTwoPoints) {
  std::mt19937 random(1);
  auto pairs = moved_points(kTruth, 3, random);
  EXPECT_FALSE(align_points({pairs[0], pairs[1]}));
  pairs[2].p_query = 2.0 * pairs[1].p_query - pairs[0].p_query;
  pairs[2].p_place = 2.0 * pairs[1].p_place - pairs[0].p_place;
  EXPECT_FALSE(align_points(pairs));
}

TEST(RigidRansacTest, FindsTheMotionAmongWrongPairs) {
  std::mt19937 random(2);
  auto pairs = moved_points(kTruth, 30, random);
  const auto wrong = moved_points(SE3(), 70, random);
  for (const auto& pair : wrong) pairs.push_back({pair.p_place, -2.0 * pair.p_query, 0.05});
  const auto count = [&](const SE3& T) {
    return static_cast<int>(std::count_if(pairs.begin(), pairs.end(), [&](const PointPair& pair) {
      return (T * pair.p_query - pair.p_place).norm() < 0.05;
    }));
  };
  const auto T = rigid_ransac(pairs, {400, 1, pairs.size()}, count);
  ASSERT_TRUE(T);
  EXPECT_LT(geometry::local(kTruth, *T).norm(), 1e-9);
  EXPECT_FALSE(rigid_ransac({}, {}, count));
}

}  // namespace
}  // namespace camvox::loop
