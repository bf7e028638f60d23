#include "camvox/trajectory/metrics.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace camvox::trajectory {
namespace {

/// Straight ahead in steps of 1 m; the estimate is `scale` as long and turns by `turn_rad` a step.
std::vector<PosePair> straight(int steps, double scale, double turn_rad = 0.0) {
  std::vector<PosePair> pairs;
  geometry::SE3 estimate;
  const geometry::SE3 step(geometry::SO3::exp({0.0, 0.0, turn_rad}), {scale, 0.0, 0.0});
  for (int i = 0; i <= steps; ++i) {
    pairs.push_back({{i, {geometry::SO3(), {1.0 * i, 0.0, 0.0}}}, {i, estimate}});
    estimate = estimate * step;
  }
  return pairs;
}

TEST(Statistics, AreThoseOfAListDoneByHand) {
  const auto figures = statistics({4.0, 1.0, 2.0, 1.0});
  EXPECT_EQ(figures.count, 4U);
  EXPECT_EQ(figures.max, 4.0);
  EXPECT_EQ(figures.min, 1.0);
  EXPECT_EQ(figures.mean, 2.0);
  EXPECT_EQ(figures.median, 1.5);
  EXPECT_EQ(figures.sse, 22.0);
  EXPECT_DOUBLE_EQ(figures.rmse, std::sqrt(5.5));
  EXPECT_DOUBLE_EQ(figures.std, std::sqrt(1.5));
  EXPECT_EQ(statistics({3.0, 9.0, 1.0}).median, 3.0);
  EXPECT_EQ(statistics({}).rmse, 0.0);
}

TEST(AbsoluteErrors, AreDistancesAndAngles) {
  const auto pairs = straight(3, 1.5);
  EXPECT_EQ(absolute_errors_m(pairs), (std::vector<double>{0.0, 0.5, 1.0, 1.5}));
  EXPECT_NEAR(absolute_errors_rad(straight(3, 1.0, 0.2))[3], 0.6, 1e-12);
}

TEST(RelativeErrors, ByPathTakeStretchesOfTheEstimate) {
  const auto errors = relative_errors_by_path(straight(20, 1.25), 5.0);
  ASSERT_EQ(errors.size(), 4U) << "20 steps of 1.25 m, the first stretch left out";
  for (const auto& error : errors) {
    EXPECT_EQ(error.to - error.from, 4U);
    EXPECT_NEAR(error.length_m, 4.0, 1e-12);
    EXPECT_NEAR(error.translation_m, 1.0, 1e-12);
  }
}

TEST(RevisitErrors, AreBetweenTwoPassesOfAPlace) {
  // Twice around a square of 10 m in steps of 1 m; the estimate drifts by 1 cm a step along x.
  std::vector<PosePair> pairs;
  geometry::SE3 T;
  for (int i = 0; i < 80; ++i) {
    const geometry::SE3 drift(geometry::SO3(), {0.01 * i, 0.0, 0.0});
    pairs.push_back({{i, T}, {i, drift * T}});
    const double turn_rad = i % 10 == 9 ? M_PI / 2 : 0.0;
    T = T * geometry::SE3(geometry::SO3::exp({0.0, 0.0, turn_rad}), {1.0, 0.0, 0.0});
  }
  const auto errors = revisit_errors(pairs);
  ASSERT_EQ(errors.size(), 40U) << "the whole second lap";
  for (const auto& error : errors) {
    EXPECT_EQ(error.to - error.from, 40U);
    EXPECT_NEAR(error.translation_m, 0.4, 1e-9);
    EXPECT_NEAR(error.rotation_rad, 0.0, 1e-9);
  }
  EXPECT_TRUE(revisit_errors(straight(50, 1.0)).empty());
  EXPECT_TRUE(revisit_errors({}).empty());
}

TEST(RevisitErrors, TheOtherDirectionIsNone) {
  auto pairs = straight(50, 1.0);
  const geometry::SE3 back(geometry::SO3::exp({0.0, 0.0, M_PI}), {0.0, 0.0, 0.0});
  for (int i = 50; i >= 0; --i) {
    const geometry::SE3 T = geometry::SE3(geometry::SO3(), {1.0 * i, 0.0, 0.0}) * back;
    pairs.push_back({{101 - i, T}, {101 - i, T}});
  }
  EXPECT_TRUE(revisit_errors(pairs).empty());
}

TEST(RelativeErrors, ByFramesTakeConsecutiveStretches) {
  const auto errors = relative_errors_by_frames(straight(10, 1.0, 0.01), 3);
  ASSERT_EQ(errors.size(), 3U);
  EXPECT_EQ(errors[2].from, 6U);
  EXPECT_NEAR(errors[2].rotation_rad, 0.03, 1e-12);
  EXPECT_TRUE(relative_errors_by_frames(straight(10, 1.0), 0).empty());
  EXPECT_TRUE(relative_errors_by_frames({}, 3).empty());
}

TEST(KittiErrors, OfAScaledAndTurningPathAreKnown) {
  const auto scaled = kitti_errors(straight(1000, 1.01));
  ASSERT_TRUE(scaled.has_value());
  // Stretches end at the first pose past the length: at most 1 m of 100 m (1 %) longer.
  EXPECT_NEAR(scaled->t_rel_percent, 1.0, 0.01);
  EXPECT_NEAR(scaled->r_rel_deg_per_100m, 0.0, 1e-9);
  const double turn_rad = 1e-5;
  const auto turned = kitti_errors(straight(1000, 1.0, turn_rad));
  EXPECT_NEAR(turned->r_rel_deg_per_100m, 100.0 * turn_rad * 180.0 / M_PI, 0.01 * 0.0573);
  EXPECT_FALSE(kitti_errors(straight(50, 1.0))) << "shorter than 100 m";
}

}  // namespace
}  // namespace camvox::trajectory
