#include "camvox/tracking_component/rotation_history.hpp"

#include <gtest/gtest.h>

namespace camvox::tracking_component {
namespace {

using geometry::SO3;

TEST(RotationHistoryTest, ChainsOverFramesThatWereLeftOut) {
  RotationHistory history;
  const SO3 a = SO3::exp({0.1, 0.0, 0.0});
  const SO3 b = SO3::exp({0.0, 0.2, 0.0});
  history.add(5, a);
  history.add(6, b);
  EXPECT_LT((history.between(4, 5)->inverse() * a).angle_rad(), 1e-12);
  EXPECT_LT((history.between(4, 6)->inverse() * (a * b)).angle_rad(), 1e-12);
}

TEST(RotationHistoryTest, NothingWhereAFrameIsMissing) {
  RotationHistory history;
  history.add(5, SO3());
  history.add(7, SO3());
  EXPECT_FALSE(history.between(4, 7));
  EXPECT_FALSE(history.between(0, 5)) << "no frame before";
  EXPECT_FALSE(history.between(5, 5));
  EXPECT_FALSE(history.between(7, 5));
}

TEST(RotationHistoryTest, IsBounded) {
  RotationHistory history;
  for (std::uint64_t id = 1; id <= 1000; ++id) history.add(id, SO3());
  EXPECT_FALSE(history.between(1, 2));
  EXPECT_TRUE(history.between(1000 - RotationHistory::kCapacity, 1000));
}

}  // namespace
}  // namespace camvox::tracking_component
