#include "camvox/lidar/stationary.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace camvox::lidar {
namespace {

using Samples = std::vector<std::array<double, 6>>;

Samples imu(double gyro_sigma, double force_sigma, double gyro_mean = 0.003) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  Samples samples(20);
  for (auto& sample : samples) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      sample[axis] = gyro_mean + gyro_sigma * normal(random);
      sample[axis + 3] = (axis == 2 ? 9.81 : 0.0) + force_sigma * normal(random);
    }
  }
  return samples;
}

TEST(ImuIsStationary, TellsStandstillFromMotion) {
  const StationaryConfig config;
  EXPECT_TRUE(imu_is_stationary(imu(0.001, 0.02), config));
  EXPECT_FALSE(imu_is_stationary(imu(0.05, 0.02), config));
  EXPECT_FALSE(imu_is_stationary(imu(0.001, 0.5), config));
  EXPECT_FALSE(imu_is_stationary(imu(0.001, 0.02, 0.2), config));  // an even turn
}

TEST(ImuIsStationary, NoEvidenceIsNoStandstill) {
  auto samples = imu(0.001, 0.02);
  EXPECT_FALSE(imu_is_stationary({}, {}));
  EXPECT_FALSE(imu_is_stationary(std::span(samples).first(3), {}));
  samples[3][1] = std::nan("");
  EXPECT_FALSE(imu_is_stationary(samples, {}));
}

/// A textured view, moved sideways, with pixel noise and a gain.
BlockImage view(double shift_px, double gain = 1.0, double person_px = 0.0, unsigned seed = 1) {
  constexpr std::size_t kWidth = 320, kHeight = 160;
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 2.0);
  std::vector<std::uint8_t> pixels(kWidth * kHeight);
  for (std::size_t v = 0; v < kHeight; ++v) {
    for (std::size_t u = 0; u < kWidth; ++u) {
      const double x = static_cast<double>(u) + shift_px, y = static_cast<double>(v);
      double value = 110.0 + 50.0 * std::sin(0.05 * x) + 30.0 * std::sin(0.07 * y + 0.03 * x);
      if (person_px > 0.0 && std::abs(x - person_px) < 8.0 && v > 90) value = 20.0;
      pixels[v * kWidth + u] =
          static_cast<std::uint8_t>(std::clamp(gain * value + noise(random), 0.0, 255.0));
    }
  }
  return block_means(pixels.data(), kWidth, kHeight, kWidth);
}

TEST(BlockMeans, AreMeans) {
  std::vector<std::uint8_t> pixels(40 * 40, 10);
  for (std::size_t v = 0; v < 16; ++v) {
    for (std::size_t u = 16; u < 32; ++u) pixels[v * 40 + u] = 200;
  }
  const auto blocks = block_means(pixels.data(), 38, 40, 40);
  EXPECT_EQ(blocks.columns, 2U);
  EXPECT_EQ(blocks.means, (std::vector<float>{10.0F, 200.0F, 10.0F, 10.0F}));
}

TEST(ChangedBlocks, NoiseAndExposureAreNoMotion) {
  EXPECT_LT(changed_blocks(view(0.0), view(0.0, 1.0, 0.0, 2), {}), 0.01);
  EXPECT_LT(changed_blocks(view(0.0), view(0.0, 1.1, 0.0, 2), {}), 0.01);
  EXPECT_GT(changed_blocks(view(0.0), view(4.0, 1.0, 0.0, 2), {}), 0.3);
}

TEST(ChangedBlocks, ImagesThatCannotBeComparedHaveChanged) {
  EXPECT_EQ(changed_blocks({}, view(0.0), {}), 1.0);
  EXPECT_EQ(changed_blocks({}, {}, {}), 1.0);
}

class StationaryDetectorTest : public ::testing::Test {
 protected:
  StationaryDetector detector_{StationaryConfig{}};
  Samples still_ = imu(0.001, 0.02);
  Samples moving_ = imu(0.1, 0.5);
};

TEST_F(StationaryDetectorTest, NeedsBothKindsOfEvidenceForSomeFrames) {
  EXPECT_FALSE(detector_.add(view(0.0), still_));
  EXPECT_FALSE(detector_.add(view(0.0), still_));
  EXPECT_FALSE(detector_.add(view(0.0), still_));
  EXPECT_TRUE(detector_.add(view(0.0), still_));
  EXPECT_FALSE(detector_.add(view(0.0), moving_));
  EXPECT_FALSE(detector_.add(view(0.0), still_));
}

TEST_F(StationaryDetectorTest, WithoutImuNothingIsStill) {
  for (int i = 0; i < 10; ++i) EXPECT_FALSE(detector_.add(view(0.0), {}));
}

// Defect 15 of CamVox: a slow creep is taken for standstill there, people for motion.
TEST_F(StationaryDetectorTest, NoticesASlowCreep) {
  int still = 0;
  for (int i = 0; i < 60; ++i) still += detector_.add(view(0.15 * i), still_) ? 1 : 0;
  EXPECT_LT(still, 50);
  bool restarted = false;
  for (int i = 0; i < 60; ++i)
    restarted = restarted || !detector_.add(view(9.0 + 0.15 * i), still_);
  EXPECT_TRUE(restarted);
}

TEST_F(StationaryDetectorTest, PeopleMayWalkBy) {
  for (int i = 0; i < 5; ++i) detector_.add(view(0.0), still_);
  for (int i = 0; i < 10; ++i) {
    EXPECT_TRUE(detector_.add(view(0.0, 1.0, 40.0 + 8.0 * i), still_)) << i;
  }
}

}  // namespace
}  // namespace camvox::lidar
