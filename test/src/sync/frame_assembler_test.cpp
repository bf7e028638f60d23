#include "camvox/sync/frame_assembler.hpp"

#include <gtest/gtest.h>

#include <random>

namespace camvox::sync {
namespace {

constexpr std::int64_t kMs = 1'000'000;

LidarChunk chunk_at(std::int64_t ms, std::int64_t duration_ms = 100) {
  LidarChunk chunk;
  chunk.stamp_ns = ms * kMs;
  for (std::int64_t offset_ms = 0; offset_ms < duration_ms; ++offset_ms) {
    chunk.returns.push_back(
        {1.0F, 0.0F, 0.0F, 0.0F, static_cast<std::uint32_t>(offset_ms * kMs), 0});
  }
  chunk.end_ns = chunk.stamp_ns + (duration_ms - 1) * kMs;
  return chunk;
}

SyncConfig without_imu() {
  SyncConfig config;
  config.use_imu = false;
  return config;
}

void add_image(FrameAssembler& assembler, std::int64_t ms, std::int64_t now_ms) {
  ASSERT_EQ(assembler.judge_image(ms * kMs), ImageVerdict::kAccepted);
  assembler.add_image(ms * kMs, now_ms * kMs);
}

TEST(FrameAssembler, BadConfigSaysEverythingThatIsWrong) {
  SyncConfig config;
  config.scan_window = "whenever";
  config.window_s = 0.0;
  try {
    FrameAssembler assembler(config, {});
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 2U);
  }
}

struct WindowCase {
  const char* name;
  std::int64_t begin_ms, end_ms;
};

class ScanWindow : public ::testing::TestWithParam<WindowCase> {};

TEST_P(ScanWindow, LiesWhereItsNameSays) {
  auto config = without_imu();
  config.scan_window = GetParam().name;
  FrameAssembler assembler(config, {});
  for (const std::int64_t ms : {900, 1000, 1100}) assembler.add_lidar(chunk_at(ms), 0);
  add_image(assembler, 1000, 0);
  const auto frame = assembler.take_ready(0);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->window.begin_ns, GetParam().begin_ms * kMs);
  EXPECT_EQ(frame->window.end_ns, GetParam().end_ms * kMs);
  EXPECT_TRUE(frame->has_lidar);
}
INSTANTIATE_TEST_SUITE_P(All,
                         ScanWindow,
                         ::testing::Values(WindowCase{"before", 900, 1000},
                                           WindowCase{"centred", 950, 1050},
                                           WindowCase{"after", 1000, 1100}),
                         [](const auto& given) { return given.param.name; });

TEST(FrameAssembler, WaitsForImuBehindTheWindow) {
  FrameAssembler assembler({}, {});
  assembler.add_lidar(chunk_at(0), 0);
  add_image(assembler, 100, 100);
  for (std::int64_t ms = 0; ms < 100; ms += 5) assembler.add_imu({ms * kMs, {}, {}}, 100 * kMs);
  EXPECT_FALSE(assembler.take_ready(110 * kMs));
  assembler.add_imu({100 * kMs, {}, {}}, 110 * kMs);
  const auto frame = assembler.take_ready(110 * kMs);
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->has_imu);
  EXPECT_EQ(frame->imu.size(), 21U);
}

TEST(FrameAssembler, GoesWithoutWhatDoesNotComeInTime) {
  FrameAssembler assembler({}, {});
  add_image(assembler, 100, 100);
  EXPECT_FALSE(assembler.take_ready(249 * kMs));
  const auto frame = assembler.take_ready(250 * kMs);  // max_wait_s
  ASSERT_TRUE(frame);
  EXPECT_FALSE(frame->has_lidar);
  EXPECT_FALSE(frame->has_imu);
  EXPECT_EQ(assembler.frame_counters().without_lidar, 1U);
  EXPECT_EQ(assembler.frame_counters().without_imu, 1U);
}

TEST(FrameAssembler, AGapThatIsNotFilledInTimeStays) {
  FrameAssembler assembler(without_imu(), {.lockstep = true});
  assembler.add_lidar(chunk_at(0), 0);
  add_image(assembler, 200, 0);
  assembler.add_lidar(chunk_at(200), 0);  // 100 is missing, and may be late
  EXPECT_FALSE(assembler.take_ready(0));
  assembler.add_lidar(chunk_at(300), 0);
  const auto frame = assembler.take_ready(0);
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->has_lidar);
  EXPECT_FALSE(assembler.lidar().covers(frame->window));
}

TEST(FrameAssembler, LockstepOutlastsABusyMachineButNotADeadSensor) {
  FrameAssembler assembler(without_imu(), {.lockstep = true});
  assembler.add_lidar(chunk_at(0), 0);
  add_image(assembler, 500, 0);
  EXPECT_FALSE(assembler.take_ready(5'000 * kMs));
  EXPECT_TRUE(assembler.take_ready(11'000 * kMs));
  add_image(assembler, 600, 11'000);
  EXPECT_TRUE(assembler.take_ready(11'000 * kMs));  // given up
}

TEST(FrameAssembler, TooManyPendingImagesEndTheOldestWait) {
  auto config = without_imu();
  config.max_pending_frames = 2;
  FrameAssembler assembler(config, {});
  assembler.add_lidar(chunk_at(0, 50), 300 * kMs);
  for (const std::int64_t ms : {100, 200, 300}) add_image(assembler, ms, 300);
  const auto frame = assembler.take_ready(300 * kMs);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->stamp_ns, 100 * kMs);
  EXPECT_FALSE(assembler.take_ready(300 * kMs));
}

// Streams with every fault at once: what comes out is in order, and each return is in the window
// of its frame.
TEST(FrameAssembler, NeverPairsWrongly) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    FrameAssembler assembler(without_imu(), {});
    std::int64_t last_stamp_ns = 0;
    const auto check = [&](std::int64_t now_ms) {
      while (const auto frame = assembler.take_ready(now_ms * kMs)) {
        EXPECT_GT(frame->stamp_ns, last_stamp_ns);
        last_stamp_ns = frame->stamp_ns;
        static float points[4096][4];
        static std::uint32_t offsets[4096];
        static std::uint8_t lines[4096];
        const auto cut =
            assembler.lidar().cut(frame->window, {{points, 4096}, {offsets, 4096}, {lines, 4096}});
        ASSERT_LE(cut.count, 150U);  // messages that overlap: some stamps are wrong by up to 0.3 s
        for (std::size_t i = 0; i < cut.count; ++i) {
          const std::int64_t age_ns = frame->stamp_ns - (cut.stamp_ns + offsets[i]);
          ASSERT_GT(age_ns, 0);
          ASSERT_LE(age_ns, 102 * kMs);
        }
      }
    };
    for (std::int64_t ms = 1000; ms < 11'000; ms += 10) {
      const auto fault = random() % 10;
      const auto delay_ms = fault == 0 ? static_cast<std::int64_t>(random() % 300) : 0;
      if (fault != 1) assembler.add_lidar(chunk_at(ms - delay_ms, 10), ms * kMs);
      if (fault == 2) assembler.add_lidar(chunk_at(ms, 10), ms * kMs);
      const bool image = ms % 100 == 0 && fault != 3;
      if (image && assembler.judge_image((ms - delay_ms) * kMs) == ImageVerdict::kAccepted) {
        assembler.add_image((ms - delay_ms) * kMs, ms * kMs);
      }
      check(ms);
    }
    EXPECT_LE(assembler.lidar().size(), 2500U);
    EXPECT_GT(assembler.frame_counters().complete, 50U);
  }
}

}  // namespace
}  // namespace camvox::sync
