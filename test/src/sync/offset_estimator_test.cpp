#include "camvox/sync/offset_estimator.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace camvox::sync {
namespace {

TEST(OffsetEstimator, FindsOffsetAndJitterAmongOutliers) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.004, 0.0005);
  OffsetEstimator estimator(400);
  for (int i = 0; i < 400; ++i) estimator.add(i % 20 == 0 ? 1.0 : noise(random));
  const auto estimate = estimator.estimate();
  EXPECT_EQ(estimate.count, 400U);
  EXPECT_NEAR(estimate.offset_s, 0.004, 1e-4);  // 2.5 standard errors of the median and its bias
  EXPECT_NEAR(estimate.jitter_s, 0.0005, 1e-4);
}

TEST(OffsetEstimator, FollowsTheLatestValues) {
  OffsetEstimator estimator(10);
  for (int i = 0; i < 100; ++i) estimator.add(1.0);
  for (int i = 0; i < 10; ++i) estimator.add(2.0);
  EXPECT_EQ(estimator.estimate().offset_s, 2.0);
}

TEST(OffsetEstimator, NothingFromNothing) {
  OffsetEstimator estimator;
  estimator.add(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(estimator.estimate().count, 0U);
}

}  // namespace
}  // namespace camvox::sync
