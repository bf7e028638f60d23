#include "camvox/tracking/depth_alignment.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace camvox::tracking {
namespace {

using geometry::SE3;
using geometry::SO3;

const SE3 kT_map_camera(SO3::exp({0.5, -1.0, 0.3}), {10.0, -4.0, 1.0});

std::vector<PointPair> make_pairs(int count, double outlier_share, unsigned seed = 5) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.01);
  std::vector<PointPair> pairs;
  for (int i = 0; i < count; ++i) {
    PointPair pair;
    pair.p_camera = {8.0 * unit(random), 4.0 * unit(random), 12.0 + 8.0 * unit(random)};
    pair.p_map = kT_map_camera *
                 (pair.p_camera + Eigen::Vector3d(noise(random), noise(random), noise(random)));
    if (i < outlier_share * count) {
      pair.p_map += Eigen::Vector3d(unit(random), unit(random), unit(random)) * 20.0;
    }
    pairs.push_back(pair);
  }
  return pairs;
}

// 40 good pairs with 1 cm of noise: some millimetres.
TEST(DepthAlignmentTest, FindsThePoseAmongTwoThirdsOfOutliers) {
  const auto pairs = make_pairs(120, 0.66);
  const auto alignment = align_by_depth(pairs, {});
  ASSERT_TRUE(alignment);
  EXPECT_LT(geometry::local(kT_map_camera, alignment->T_map_camera).norm(), 0.02);
  EXPECT_GE(alignment->inlier_count, 40);
  EXPECT_LE(alignment->inlier_count, 44);
  EXPECT_TRUE(alignment->inliers.back());
  EXPECT_FALSE(alignment->inliers.front());
}

TEST(DepthAlignmentTest, SameSeedSameAnswer) {
  const auto pairs = make_pairs(100, 0.5);
  EXPECT_EQ(align_by_depth(pairs, {})->T_map_camera.matrix(),
            align_by_depth(pairs, {})->T_map_camera.matrix());
}

TEST(DepthAlignmentTest, NoAnswerWithoutAgreement) {
  EXPECT_FALSE(align_by_depth({}, {}));
  EXPECT_FALSE(align_by_depth(make_pairs(10, 0.0), {}));
  EXPECT_FALSE(align_by_depth(make_pairs(60, 1.0), {}));
  auto same = make_pairs(1, 0.0);
  same.resize(50, same.front());
  EXPECT_FALSE(align_by_depth(same, {}));
}

TEST(DepthAlignmentTest, NanIsAnOutlier) {
  auto pairs = make_pairs(60, 0.2);
  pairs[30].p_map.x() = std::numeric_limits<double>::quiet_NaN();
  const auto alignment = align_by_depth(pairs, {});
  ASSERT_TRUE(alignment);
  EXPECT_FALSE(alignment->inliers[30]);
}

}  // namespace
}  // namespace camvox::tracking
