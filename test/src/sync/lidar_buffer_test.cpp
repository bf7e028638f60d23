#include "camvox/sync/lidar_buffer.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <random>

namespace camvox::sync {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

/// Returns every 0.1 ms; x is the time of each in ms.
LidarChunk chunk_at(std::int64_t ms, std::int64_t duration_ms = 10) {
  LidarChunk chunk;
  chunk.stamp_ns = ms * kMs;
  for (std::int64_t offset = 0; offset < duration_ms * kMs; offset += kMs / 10) {
    chunk.returns.push_back({static_cast<float>(static_cast<double>(chunk.stamp_ns + offset) / kMs),
                             0.0F,
                             0.0F,
                             7.0F,
                             static_cast<std::uint32_t>(offset),
                             2});
    chunk.end_ns = chunk.stamp_ns + offset;
  }
  return chunk;
}

LidarWindow window(std::int64_t begin_ms, std::int64_t end_ms) {
  return {begin_ms * kMs, end_ms * kMs, end_ms * kMs, 2 * kMs, 30 * kMs, 150 * kMs};
}

/// Lists of a scan.
struct Lists {
  explicit Lists(std::size_t capacity) : points(new float[capacity][4]) {
    offsets.resize(capacity);
    lines.resize(capacity);
    view = {{points.get(), capacity}, offsets, lines};
  }
  std::unique_ptr<float[][4]> points;
  std::vector<std::uint32_t> offsets;
  std::vector<std::uint8_t> lines;
  ScanLists view;
};

TEST(LidarBuffer, CutsAcrossChunks) {
  LidarBuffer buffer(kSecond, 1'000'000);
  for (std::int64_t ms = 0; ms < 100; ms += 10) ASSERT_TRUE(buffer.add(chunk_at(ms)));
  Lists lists(1000);
  const auto cut = buffer.cut(window(25, 55), lists.view);
  ASSERT_EQ(cut.count, 300U);
  EXPECT_EQ(cut.stamp_ns, 25 * kMs);
  EXPECT_FLOAT_EQ(lists.points[0][0], 25.0F);
  EXPECT_FLOAT_EQ(lists.points[299][0], 54.9F);
  EXPECT_FLOAT_EQ(lists.points[299][3], 7.0F);
  EXPECT_EQ(lists.offsets[0], 0U);
  EXPECT_EQ(lists.offsets[299], 299U * 100'000U);
  EXPECT_EQ(lists.lines[5], 2);
}

TEST(LidarBuffer, CutAgreesWithBruteForceWhateverTheOrderOfReturns) {
  std::mt19937 random(3);
  LidarBuffer buffer(kSecond, 1'000'000);
  std::vector<double> all;
  for (std::int64_t ms = 0; ms < 300; ms += 7) {
    auto chunk = chunk_at(ms, 7);
    std::ranges::shuffle(chunk.returns, random);
    for (const auto& point : chunk.returns) all.push_back(point.x_m);
    buffer.add(std::move(chunk));
  }
  for (int trial = 0; trial < 20; ++trial) {
    auto exact = window(static_cast<int>(random() % 150), 150 + static_cast<int>(random() % 150));
    exact.tolerance_ns = 0;
    Lists lists(4000);
    const auto cut = buffer.cut(exact, lists.view);
    std::vector<double> expected, actual;
    for (const double time : all) {
      const auto time_ns = std::llround(time * kMs);
      if (time_ns >= exact.begin_ns - 50 && time_ns < exact.end_ns - 50) expected.push_back(time);
    }
    for (std::size_t i = 0; i < cut.count; ++i) {
      actual.push_back(static_cast<double>(lists.points[i][0]));
      EXPECT_NEAR(static_cast<double>(cut.stamp_ns + lists.offsets[i]) / kMs, actual.back(), 1e-4);
    }
    EXPECT_THAT(actual, ::testing::UnorderedElementsAreArray(expected));
  }
}

TEST(LidarBuffer, PutsLateChunksInPlaceAndDropsDuplicates) {
  LidarBuffer buffer(kSecond, 1'000'000);
  buffer.add(chunk_at(0));
  buffer.add(chunk_at(20));
  EXPECT_TRUE(buffer.add(chunk_at(10)));
  EXPECT_FALSE(buffer.add(chunk_at(10)));
  EXPECT_FALSE(buffer.add(chunk_at(20)));
  Lists lists(1000);
  EXPECT_EQ(buffer.cut(window(0, 30), lists.view).count, 300U);
  EXPECT_FLOAT_EQ(lists.points[150][0], 15.0F);
  EXPECT_EQ(buffer.counters().reordered, 1U);
  EXPECT_EQ(buffer.counters().duplicates, 2U);
}

TEST(LidarBuffer, CoversOnlyWhatHasNoGap) {
  LidarBuffer buffer(kSecond, 1'000'000);
  EXPECT_FALSE(buffer.covers(window(0, 10)));
  buffer.add(chunk_at(0, 50));
  buffer.add(chunk_at(100, 50));
  EXPECT_TRUE(buffer.covers(window(0, 50)));
  EXPECT_FALSE(buffer.covers(window(0, 60)));
  EXPECT_FALSE(buffer.covers(window(0, 120)));
  EXPECT_TRUE(buffer.covers(window(100, 150)));
  buffer.add(chunk_at(50, 50));
  EXPECT_TRUE(buffer.covers(window(0, 120)));
}

// What a window holds depends on the lidar's messages alone, not on when it is cut.
TEST(LidarBuffer, AChunkThatComesTooLateIsNotForAWindowThatIsSettled) {
  LidarBuffer buffer(kSecond, 1'000'000);
  buffer.add(chunk_at(0, 100));
  buffer.add(chunk_at(200, 100));
  EXPECT_FALSE(buffer.is_settled(window(100, 200)));  // 300 - 200 is less than 150
  EXPECT_TRUE(buffer.is_settled(window(50, 149)));
  buffer.add(chunk_at(100, 100));
  Lists lists(2000);
  EXPECT_EQ(buffer.cut(window(100, 200), lists.view).count, 1000U);
  EXPECT_EQ(buffer.cut(window(50, 149), lists.view).count, 500U);
  EXPECT_TRUE(buffer.is_settled(window(100, 200)));
}

TEST(LidarBuffer, WindowsEndMovesToAMessagesBoundaryNearBy) {
  LidarBuffer early(kSecond, 1'000'000), late(kSecond, 1'000'000);
  for (auto* buffer : {&early, &late}) buffer->add(chunk_at(0, 99));
  late.add(chunk_at(99, 100));
  // The trigger came 1 ms after the message's end: complete without the next message, and with it
  // the same.
  Lists a(2000), b(2000);
  EXPECT_TRUE(early.covers(window(0, 100)));
  EXPECT_TRUE(late.covers(window(0, 100)));
  EXPECT_EQ(early.cut(window(0, 100), a.view).count, 990U);
  EXPECT_EQ(late.cut(window(0, 100), b.view).count, 990U);
  EXPECT_EQ(late.cut(window(100, 199), b.view).count, 1000U);  // nothing is lost between windows
}

TEST(LidarBuffer, ASteadyDriversMessageLastsAPeriod) {
  LidarBuffer buffer(kSecond, 1'000'000);
  for (const std::int64_t ms : {0, 100, 200, 300}) buffer.add(chunk_at(ms, 60));  // then sky
  EXPECT_TRUE(buffer.covers(window(300, 400)));
}

TEST(LidarBuffer, UntimedCloudsGoWholeToTheNearestImage) {
  LidarBuffer buffer(kSecond, 1'000'000);
  for (const std::int64_t ms : {0, 100, 200}) {
    auto chunk = chunk_at(ms, 10);
    for (auto& point : chunk.returns) point.offset_ns = 0;
    chunk.end_ns = chunk.stamp_ns;
    chunk.has_point_times = false;
    buffer.add(std::move(chunk));
  }
  Lists lists(1000);
  const auto cut = buffer.cut({30 * kMs, 130 * kMs, 130 * kMs, 0, 30 * kMs, 150 * kMs}, lists.view);
  EXPECT_EQ(cut.count, 100U);
  EXPECT_EQ(cut.stamp_ns, 100 * kMs);
  EXPECT_EQ(lists.offsets[99], 0U);
}

TEST(LidarBuffer, RefusesMoreThanTheScanHolds) {
  LidarBuffer buffer(kSecond, 1'000'000);
  buffer.add(chunk_at(0, 100));
  Lists lists(500);
  const auto cut = buffer.cut(window(0, 80), lists.view);
  EXPECT_TRUE(cut.over_capacity);
  EXPECT_EQ(cut.count, 0U);
  EXPECT_EQ(buffer.cut(window(0, 50), lists.view).count, 500U);
}

TEST(LidarBuffer, MemoryIsBoundedAndReused) {
  LidarBuffer buffer(kSecond, 5000);
  for (std::int64_t ms = 0; ms < 1000; ms += 10) buffer.add(chunk_at(ms));
  EXPECT_LE(buffer.size(), 5000U);
  EXPECT_GE(buffer.take_spare().capacity(), 100U);
  EXPECT_FALSE(buffer.add(chunk_at(5)));  // forgotten long ago
  EXPECT_EQ(buffer.counters().late, 1U);
}

TEST(LidarBuffer, EmptyChunksAreFine) {
  LidarBuffer buffer(kSecond, 5000);
  LidarChunk empty;
  empty.stamp_ns = empty.end_ns = 10 * kMs;
  EXPECT_TRUE(buffer.add(std::move(empty)));
  Lists lists(10);
  const auto cut = buffer.cut(window(0, 100), lists.view);
  EXPECT_EQ(cut.count, 0U);
  EXPECT_EQ(cut.stamp_ns, 0);
}

}  // namespace
}  // namespace camvox::sync
