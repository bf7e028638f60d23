#include "slow_projection.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace camvox::test {
namespace {

/// A floor, a wall, two boxes and posts before it, and a bush that has a depth of its own for every
/// return: one of each thing that the projection tells apart.
float depth_m(double x, double y, std::mt19937_64& random) {
  const double floor_m = y > 0.02 ? 1.6 / y : 1e3;
  double z_m = std::min(floor_m, 18.0 / (1.0 + 0.4 * x));
  if (x > -0.5 && x < -0.2 && y > -0.15) z_m = std::min(z_m, 6.0);
  if (x > 0.05 && x < 0.12 && y > -0.2) z_m = std::min(z_m, 9.0);
  if (std::abs(std::fmod(x + 2.0, 0.11)) < 0.006) z_m = std::min(z_m, 12.0);
  if (std::hypot(x - 0.4, y + 0.05) < 0.15) {
    z_m = std::min(z_m, std::uniform_real_distribution<>(7.0, 10.0)(random));
  }
  return static_cast<float>(y < -0.2 && x < 0.0 ? 0.0 : z_m);  // The sky gives no return.
}

std::vector<float> scan(std::size_t count, std::mt19937_64& random) {
  std::uniform_real_distribution<> across(-1.0, 1.0);
  std::normal_distribution<> noise(0.0, 0.02);
  std::vector<float> points;
  while (points.size() < 4 * count) {
    const Eigen::Vector3d f(across(random), 0.45 * across(random), 1.0);
    const double z_m = depth_m(f.x(), f.y(), random);
    if (!(z_m > 0.0)) continue;
    const Eigen::Vector3d p = f * z_m * (1.0 + noise(random) / (z_m * f.norm()));
    for (const double value : {p.x(), p.y(), p.z(), 0.0})
      points.push_back(static_cast<float>(value));
  }
  return points;
}

/// The fast one differs on purpose in three points, each of few pixels: of more than 64 returns
/// around a cell it looks at every second; a surface whose outline does not touch the cell keeps
/// others away with its first guess of a plane; and sums of another order change a decision that
/// hangs on the last bit.
TEST(SlowProjection, FastOneAgrees) {
  const sensors::CameraModel camera{sensors::CameraIntrinsics{}};
  std::mt19937_64 random(11);
  for (const std::size_t returns : {std::size_t{4'000}, std::size_t{20'000}}) {
    const auto points = scan(returns, random);
    const depth::ScanView view{points, {geometry::SO3(), {0.12, -0.05, 0.03}}};
    SlowProjection slow(camera, {});
    slow.project(view);
    std::vector<float> depth_m(slow.depth_m.size());
    std::vector<float> sigma_m(depth_m.size());
    depth::DepthProjector fast(camera, {});
    const auto report = fast.project({&view, 1}, depth_m, sigma_m);
    EXPECT_EQ(report.hidden, static_cast<std::size_t>(slow.hidden));
    EXPECT_GT(report.hidden, 10U);
    std::size_t in_both = 0, in_one = 0, depth_differs = 0, sigma_differs = 0;
    for (std::size_t px = 0; px < depth_m.size(); ++px) {
      const bool a = depth_m[px] > 0.0F;
      const bool b = slow.depth_m[px] > 0.0F;
      in_both += a && b ? 1 : 0;
      in_one += a != b ? 1 : 0;
      if (!a || !b) continue;
      depth_differs += std::abs(depth_m[px] / slow.depth_m[px] - 1.0F) > 1e-4F ? 1 : 0;
      sigma_differs += std::abs(sigma_m[px] / slow.sigma_m[px] - 1.0F) > 1e-2F ? 1 : 0;
    }
    RecordProperty("in_one_" + std::to_string(returns), std::to_string(in_one));
    EXPECT_GT(in_both, 50'000U) << returns;
    EXPECT_LT(static_cast<double>(in_one), 0.005 * static_cast<double>(in_both)) << returns;
    EXPECT_LT(static_cast<double>(depth_differs), 1e-4 * static_cast<double>(in_both)) << returns;
    EXPECT_LT(static_cast<double>(sigma_differs), 1e-4 * static_cast<double>(in_both)) << returns;
  }
}

}  // namespace
}  // namespace camvox::test
