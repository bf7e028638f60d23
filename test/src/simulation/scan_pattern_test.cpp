#include "camvox/simulation/scan_pattern.hpp"

#include <gmock/gmock.h>

#include <fstream>
#include <iostream>
#include <numbers>
#include <set>
#include <sstream>
#include <vector>

namespace camvox::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

struct Angles {
  double azimuth_deg;
  double elevation_deg;
};

std::vector<Angles> simulate(double seconds) {
  std::vector<Angles> shots;
  const auto count = static_cast<std::int64_t>(seconds * 1e9 / 4167.0);
  for (std::int64_t shot = 0; shot < count; ++shot) {
    const auto direction = HorizonPattern::direction(shot, 4167, 6);
    shots.push_back({direction.azimuth_rad / kDegree, direction.elevation_rad / kDegree});
  }
  return shots;
}

/// Share of the cells of `cell_deg` in an ellipse-free box of the field of view that were hit.
double coverage(const std::vector<Angles>& shots, double cell_deg, double half_az, double half_el) {
  std::set<std::pair<int, int>> cells;
  for (const auto& [az, el] : shots) {
    if (std::abs(az) >= half_az || std::abs(el) >= half_el) continue;
    cells.emplace(static_cast<int>(std::floor(az / cell_deg)),
                  static_cast<int>(std::floor(el / cell_deg)));
  }
  return static_cast<double>(cells.size()) * cell_deg * cell_deg / (4 * half_az * half_el);
}

TEST(HorizonPattern, FieldOfViewIsTheHorizons) {
  double az_max = 0, az_min = 0, el_max = 0, el_min = 0;
  for (const auto& [az, el] : simulate(5.0)) {
    az_max = std::max(az_max, az), az_min = std::min(az_min, az);
    el_max = std::max(el_max, el), el_min = std::min(el_min, el);
  }
  // 81.7 x 25.1 degrees by the data sheet.
  EXPECT_NEAR(az_max - az_min, 81.7, 0.5);
  EXPECT_NEAR(el_max - el_min, 25.1, 0.5);
}

TEST(HorizonPattern, DensityGrowsWithIntegrationTime) {
  const double c01 = coverage(simulate(0.1), 0.2, 35, 10);
  const double c1 = coverage(simulate(1.0), 0.2, 35, 10);
  const double c5 = coverage(simulate(5.0), 0.2, 35, 10);
  std::cout << "share of 0.2 degree cells hit in the inner 70 x 20 degrees: " << c01
            << " in 0.1 s, " << c1 << " in 1 s, " << c5 << " in 5 s\n";
  // 24 000 shots per 0.1 s on 51 000 such cells (of the whole field): at most half can be hit at
  // first; a repeating pattern would stay there.
  EXPECT_GT(c01, 0.15);
  EXPECT_LT(c01, 0.45);
  EXPECT_GT(c1, 2.0 * c01);
  EXPECT_GT(c5, 0.97);
}

TEST(HorizonPattern, SixLinesInTurn) {
  const auto first = HorizonPattern::direction(0, 4167, 6);
  const auto last = HorizonPattern::direction(5, 4167, 6);
  EXPECT_NEAR((last.elevation_rad - first.elevation_rad) / kDegree, 5 * 0.91, 0.05);
  const Eigen::Vector3d left = HorizonPattern::bearing({0.5, 0.0});
  EXPECT_GT(left.y(), 0.0);
  EXPECT_NEAR(HorizonPattern::bearing({0.3, 0.1}).norm(), 1.0, 1e-15);
}

std::vector<Angles> read_real_frame(const std::string& path) {
  std::vector<Angles> shots;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    double x = 0, y = 0, z = 0;
    char comma = 0;
    std::istringstream text(line);
    if (!(text >> x >> comma >> y >> comma >> z)) continue;
    const double azimuth = std::atan2(y, x) / kDegree;
    if (x * x + y * y + z * z < 0.5) continue;  // The device's "no return".
    shots.push_back({azimuth, std::atan2(z, std::hypot(x, y)) / kDegree});
  }
  return shots;
}

TEST(HorizonPattern, LooksLikeARealFrame) {
  const auto real = read_real_frame(std::string(SHARED_DATA) + "/livox_frame/horizon_100ms.csv");
  if (real.empty()) GTEST_SKIP() << "no real Horizon frame in " << SHARED_DATA;
  // As many consecutive shots as the real frame has, over the lower half (the upper half of the
  // real frame is sky without returns).
  auto simulated = simulate(0.087);
  std::erase_if(simulated, [](const Angles& a) { return a.elevation_deg > 0; });
  auto lower = real;
  std::erase_if(lower, [](const Angles& a) { return a.elevation_deg > 0; });
  const double c_real = coverage(lower, 0.5, 35, 10) * 2;
  const double c_simulated = coverage(simulated, 0.5, 35, 10) * 2;
  double az_real = 0, el_real = 0, az_simulated = 0, el_simulated = 0;
  for (const auto& a : lower)
    az_real = std::max(az_real, std::abs(a.azimuth_deg)),
    el_real = std::max(el_real, -a.elevation_deg);
  for (const auto& a : simulated)
    az_simulated = std::max(az_simulated, std::abs(a.azimuth_deg)),
    el_simulated = std::max(el_simulated, -a.elevation_deg);
  std::cout << "0.5 degree cells hit below the horizon, real " << c_real << " (" << lower.size()
            << " returns), simulated " << c_simulated << " (" << simulated.size()
            << "); azimuth to " << az_real << " / " << az_simulated << ", elevation to -" << el_real
            << " / -" << el_simulated << " degrees\n";
  EXPECT_NEAR(az_simulated, az_real, 3.0);
  EXPECT_NEAR(el_simulated, el_real, 2.0);
  // The real scene swallows some shots (near objects, no returns), hence the factor of two.
  EXPECT_LT(c_real, 1.3 * c_simulated);
  EXPECT_GT(c_real, 0.5 * c_simulated);
}

}  // namespace
}  // namespace camvox::simulation
