#include "camvox/simulation/scan_pattern.hpp"

#include <cmath>
#include <numbers>

namespace camvox::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kFastRate_hz = 131.1397;
constexpr double kSlowRate_hz = 12.9713;
constexpr double kFastAzimuth_rad = 28.3 * kDegree;
constexpr double kFastElevation_rad = 1.0 * kDegree;
constexpr double kFastTilt_rad = 2.53;  ///< Phase of the fast elevation against the azimuth.
constexpr double kSlowAzimuth_rad = 12.5 * kDegree;
constexpr double kSlowElevation_rad = 9.27 * kDegree;
constexpr double kLineSpacing_rad = 0.91 * kDegree;

/// The phase of a turning prism; whole turns are taken off first, so that hours stay exact.
double phase(double rate_hz, std::int64_t time_ns) {
  const double turns = rate_hz * (static_cast<double>(time_ns) * 1e-9);
  return 2.0 * std::numbers::pi * (turns - std::floor(turns));
}

}  // namespace

HorizonPattern::Direction HorizonPattern::direction(std::int64_t shot,
                                                    std::int64_t shot_interval_ns,
                                                    int lines) {
  const std::int64_t time_ns = shot * shot_interval_ns;
  const double fast = phase(kFastRate_hz, time_ns);
  const double slow = phase(kSlowRate_hz, time_ns);
  const auto line = static_cast<double>(shot % lines);
  return {kFastAzimuth_rad * std::cos(fast) + kSlowAzimuth_rad * std::cos(slow),
          kFastElevation_rad * std::cos(fast + kFastTilt_rad) -
              kSlowElevation_rad * std::sin(slow) + kLineSpacing_rad * (line - 0.5 * (lines - 1))};
}

Eigen::Vector3d HorizonPattern::bearing(const Direction& direction) {
  const double flat = std::cos(direction.elevation_rad);
  return {flat * std::cos(direction.azimuth_rad),
          flat * std::sin(direction.azimuth_rad),
          std::sin(direction.elevation_rad)};
}

}  // namespace camvox::simulation
