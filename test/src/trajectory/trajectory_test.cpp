#include "camvox/trajectory/trajectory.hpp"

#include <gtest/gtest.h>

namespace camvox::trajectory {
namespace {

Trajectory along_x(const std::vector<std::int64_t>& stamps_ns) {
  Trajectory trajectory;
  for (const auto stamp_ns : stamps_ns) {
    trajectory.push_back({stamp_ns, {geometry::SO3(), {static_cast<double>(stamp_ns), 0.0, 0.0}}});
  }
  return trajectory;
}

std::vector<std::pair<std::int64_t, std::int64_t>> stamps(const std::vector<PosePair>& pairs) {
  std::vector<std::pair<std::int64_t, std::int64_t>> result;
  for (const auto& pair : pairs)
    result.emplace_back(pair.reference.stamp_ns, pair.estimate.stamp_ns);
  return result;
}

using Stamps = std::vector<std::pair<std::int64_t, std::int64_t>>;

TEST(Associate, TakesTheNearestWithinTheBound) {
  const auto pairs = associate(along_x({0, 10, 20, 30}), along_x({-3, 11, 16, 26, 35}), 3);
  EXPECT_EQ(stamps(pairs), (Stamps{{0, -3}, {10, 11}}));
  EXPECT_EQ(stamps(associate(along_x({0, 10, 20, 30}), along_x({-3, 11, 16, 26, 35}), 5)),
            (Stamps{{0, -3}, {10, 11}, {20, 16}, {30, 26}}))
      << "26 is nearer to 30 than 35 is";
}

TEST(Associate, NoReferencePoseTwice) {
  EXPECT_EQ(stamps(associate(along_x({0, 10}), along_x({8, 9, 11, 13}), 5)), (Stamps{{10, 9}}));
}

TEST(Associate, AddsTheOffsetToTheEstimate) {
  EXPECT_EQ(stamps(associate(along_x({100}), along_x({1}), 0, 99)), (Stamps{{100, 100}}));
}

TEST(Associate, NothingFromNothing) {
  EXPECT_TRUE(associate({}, along_x({1}), 5).empty());
  EXPECT_TRUE(associate(along_x({1}), {}, 5).empty());
}

TEST(PathLength, AddsTheSteps) {
  EXPECT_EQ(path_length_m({}), 0.0);
  EXPECT_EQ(path_length_m(along_x({2, 5, 4})), 4.0);
}

}  // namespace
}  // namespace camvox::trajectory
