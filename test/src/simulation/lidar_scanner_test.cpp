#include "camvox/simulation/lidar_scanner.hpp"

#include <gmock/gmock.h>

#include <iostream>

namespace camvox::simulation {
namespace {

using Eigen::Vector3f;
using geometry::SE3;

const SurfaceShader& shader() {
  static const SurfaceShader shared(1, 2);
  return shared;
}

/// A wall across x = `distance`.
World wall(float distance, float reflectivity) {
  World world;
  world.materials.resize(1);
  world.materials[0].texture = TextureKind::kPaint;
  world.materials[0].reflectivity = reflectivity;
  const float half = 2.0f * distance;
  world.scenery.add_quad({distance, -half, -half}, {0, 2 * half, 0}, {0, 0, 2 * half}, 0);
  return world;
}

LidarScan scan_once(const World& world, const sensors::LidarModel& model = {}) {
  RayScene scene(world);
  const ScanPeriod period{0, 100'000'000, [](double) { return SE3(); }};
  return LidarScanner(model, 1, shader()).scan(scene, period, 2);
}

TEST(LidarScanner, RangeNoiseIsTheStatedOneAndUnbiased) {
  const World world = wall(10.0f, 0.5f);
  sensors::LidarModel model;
  model.angle_sigma_deg = 0.0;
  const LidarScan scan = scan_once(world, model);
  double sum = 0.0;
  double sum2 = 0.0;
  for (const LidarPoint& point : scan.points) {
    const double range = point.p_lidar.cast<double>().norm();
    const double error = range - 10.0 * range / static_cast<double>(point.p_lidar.x());
    sum += error / static_cast<double>(scan.points.size());
    sum2 += error * error / static_cast<double>(scan.points.size());
  }
  EXPECT_GT(scan.points.size(), 23'900u * 99 / 100);
  // Bias: the beam is wide, so its mean range exceeds that of its centre by some 1e-5 of it.
  EXPECT_NEAR(sum, 0.0, 0.001);
  EXPECT_NEAR(std::sqrt(sum2), 0.02, 0.0006);
}

TEST(LidarScanner, RangeFallsWithReflectivity) {
  // 260 m at 80 %, 92 m at 10 % (the square root law; the manual says 90).
  const auto share = [](float distance, float reflectivity) {
    const World world = wall(distance, reflectivity);
    const LidarScan scan = scan_once(world);
    int ahead = 0;  // Within 10 degrees of straight on, where the wall faces the beam.
    for (const auto& point : scan.points)
      ahead += std::abs(point.p_lidar.y()) < 0.17f * point.p_lidar.x();
    return ahead;
  };
  const int all = share(20.0f, 0.8f);
  EXPECT_GT(all, 4000);
  EXPECT_GT(share(220.0f, 0.8f), all * 8 / 10);
  EXPECT_LT(share(330.0f, 0.8f), all / 10);
  EXPECT_GT(share(78.0f, 0.1f), all * 8 / 10);
  EXPECT_LT(share(120.0f, 0.1f), all / 10);
}

TEST(LidarScanner, OffsetsLinesAndMillimetresAreLivoxs) {
  const World world = wall(8.0f, 0.5f);
  const LidarScan scan = scan_once(world);
  std::uint32_t before = 0;
  for (const LidarPoint& point : scan.points) {
    EXPECT_EQ(point.offset_ns % 4167, 0u);
    EXPECT_EQ(point.line, point.offset_ns / 4167 % 6);
    EXPECT_GE(point.offset_ns, before);
    EXPECT_LT(point.offset_ns, 100'000'000u);
    const double millimetres = 1000.0 * static_cast<double>(point.p_lidar.x());
    EXPECT_NEAR(millimetres, std::round(millimetres), 2e-3);
    EXPECT_LE(point.reflectivity, 150);
    before = point.offset_ns;
  }
  EXPECT_EQ(scan.points.size(), scan.truth.size());
}

TEST(LidarScanner, EdgesGiveMixedReturnsBetweenTheSurfaces) {
  // A plate 0.3 m in front of a wall: some beams straddle its edge and report a blend.
  World world = wall(10.0f, 0.5f);
  world.scenery.add_quad({9.7f, -2.0f, -1.0f}, {0, 4, 0}, {0, 0, 2}, 0);
  const LidarScan scan = scan_once(world);
  int mixed = 0;
  int between = 0;
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    if (!scan.truth[i].mixed) continue;
    ++mixed;
    EXPECT_EQ(scan.points[i].tag & 0x03, 2);
    const float x = scan.points[i].p_lidar.x();
    between += x > 9.76f && x < 9.94f;
    // Only at the rim: within the beam's half height (0.14 degrees = 2.4 cm) and pointing noise.
    const Vector3f p = scan.truth[i].p_lidar_stamp;
    const float rim = std::min(std::abs(std::abs(p.y()) - 2.0f), std::abs(std::abs(p.z()) - 1.0f));
    EXPECT_LT(rim, 0.12f);
  }
  EXPECT_GT(mixed, 20);
  EXPECT_GT(between, mixed / 4);
  EXPECT_LT(mixed, static_cast<int>(scan.points.size()) / 20);
}

TEST(LidarScanner, EmptyWorldGivesNoReturns) { EXPECT_TRUE(scan_once(World{}).points.empty()); }

TEST(LidarScanner, BadModelIsRefused) {
  sensors::LidarModel model;
  model.lines = 9;
  EXPECT_THROW(LidarScanner(model, 1, shader()), config::ConfigError);
}

}  // namespace
}  // namespace camvox::simulation
