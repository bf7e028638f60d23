#include "camvox/sync/imu_buffer.hpp"

#include <gtest/gtest.h>

namespace camvox::sync {
namespace {

ImuBuffer filled() {
  ImuBuffer buffer(1'000'000, 1000);
  for (std::int64_t stamp = 0; stamp <= 1000; stamp += 10) buffer.add({stamp, {}, {}});
  return buffer;
}

TEST(ImuBuffer, GivesOneMoreSampleOnEitherSide) {
  const auto buffer = filled();
  const auto samples = buffer.between(105, 134, 100);
  ASSERT_EQ(samples.size(), 5U);
  EXPECT_EQ(samples.front().stamp_ns, 100);
  EXPECT_EQ(samples.back().stamp_ns, 140);
}

TEST(ImuBuffer, SamplesOnTheEndsAreEnough) {
  const auto buffer = filled();
  const auto samples = buffer.between(100, 130, 100);
  ASSERT_EQ(samples.size(), 4U);
  EXPECT_EQ(samples.front().stamp_ns, 100);
  EXPECT_EQ(samples.back().stamp_ns, 130);
}

TEST(ImuBuffer, KeepsTheLatestWhenThereAreTooMany) {
  const auto samples = filled().between(0, 500, 3);
  ASSERT_EQ(samples.size(), 3U);
  EXPECT_EQ(samples.back().stamp_ns, 500);
}

TEST(ImuBuffer, NothingBeyondItsData) {
  const auto buffer = filled();
  EXPECT_EQ(buffer.between(2000, 3000, 100).size(), 1U);  // the one before
  EXPECT_EQ(ImuBuffer(1000, 10).between(0, 10, 10).size(), 0U);
}

TEST(ImuBuffer, LeavesOutLateAndDoubleSamples) {
  auto buffer = filled();
  EXPECT_FALSE(buffer.add({1000, {}, {}}));
  EXPECT_FALSE(buffer.add({995, {}, {}}));
  EXPECT_EQ(buffer.counters().duplicates, 1U);
  EXPECT_EQ(buffer.counters().late, 1U);
}

TEST(ImuBuffer, ForgetsButKeepsTheStartOfTheOldestInterval) {
  auto buffer = filled();
  buffer.forget_before(505);
  EXPECT_EQ(buffer.between(505, 510, 10).front().stamp_ns, 500);
  EXPECT_EQ(buffer.size(), 51U);
}

TEST(ImuBuffer, IsBounded) {
  ImuBuffer buffer(1'000'000, 100);
  for (std::int64_t stamp = 0; stamp < 10'000; stamp += 10) buffer.add({stamp, {}, {}});
  EXPECT_EQ(buffer.size(), 100U);
}

}  // namespace
}  // namespace camvox::sync
