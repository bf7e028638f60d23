#include "camvox/simulation/geodetic.hpp"

#include <cmath>
#include <numbers>

namespace camvox::simulation {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kRadius_m = 6378137.0;
constexpr double kFlattening = 1.0 / 298.257223563;
constexpr double kEccentricity2 = kFlattening * (2.0 - kFlattening);

}  // namespace

Eigen::Vector3d to_ecef(const Geodetic& place) {
  const double sine = std::sin(place.latitude_deg * kDegree);
  const double cosine = std::cos(place.latitude_deg * kDegree);
  const double normal = kRadius_m / std::sqrt(1.0 - kEccentricity2 * sine * sine);
  const double flat = (normal + place.altitude_m) * cosine;
  return {flat * std::cos(place.longitude_deg * kDegree),
          flat * std::sin(place.longitude_deg * kDegree),
          (normal * (1.0 - kEccentricity2) + place.altitude_m) * sine};
}

Geodetic from_ecef(const Eigen::Vector3d& p_ecef) {
  const double flat = p_ecef.head<2>().norm();
  double latitude = std::atan2(p_ecef.z(), flat * (1.0 - kEccentricity2));
  double normal = kRadius_m;
  for (int i = 0; i < 8; ++i) {
    const double sine = std::sin(latitude);
    normal = kRadius_m / std::sqrt(1.0 - kEccentricity2 * sine * sine);
    latitude = std::atan2(p_ecef.z() + kEccentricity2 * normal * sine, flat);
  }
  const double sine = std::sin(latitude);
  // Along the ellipsoid's normal; holds at the poles too.
  const double altitude = flat * std::cos(latitude) + p_ecef.z() * sine -
                          kRadius_m * std::sqrt(1.0 - kEccentricity2 * sine * sine);
  return {latitude / kDegree, std::atan2(p_ecef.y(), p_ecef.x()) / kDegree, altitude};
}

Geodetic from_enu(const Geodetic& origin, const Eigen::Vector3d& p_enu) {
  const double sin_lat = std::sin(origin.latitude_deg * kDegree);
  const double cos_lat = std::cos(origin.latitude_deg * kDegree);
  const double sin_lon = std::sin(origin.longitude_deg * kDegree);
  const double cos_lon = std::cos(origin.longitude_deg * kDegree);
  Eigen::Matrix3d R_ecef_enu;
  R_ecef_enu << -sin_lon, -sin_lat * cos_lon, cos_lat * cos_lon,  //
      cos_lon, -sin_lat * sin_lon, cos_lat * sin_lon,             //
      0.0, cos_lat, sin_lat;
  return from_ecef(to_ecef(origin) + R_ecef_enu * p_enu);
}

}  // namespace camvox::simulation
