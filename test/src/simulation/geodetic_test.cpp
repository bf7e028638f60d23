#include "camvox/simulation/geodetic.hpp"

#include <gmock/gmock.h>

namespace camvox::simulation {
namespace {

TEST(Geodetic, KnownPlaces) {
  // On the equator, at the pole: the two radii of WGS 84.
  EXPECT_LT((to_ecef({0, 0, 0}) - Eigen::Vector3d(6378137.0, 0, 0)).norm(), 1e-6);
  EXPECT_LT((to_ecef({90, 0, 0}) - Eigen::Vector3d(0, 0, 6356752.314245)).norm(), 1e-5);
}

TEST(Geodetic, InverseHoldsEverywhere) {
  for (const double latitude : {-80.0, -33.3, 0.0, 22.5958, 47.0, 89.0}) {
    for (const double longitude : {-179.0, -60.0, 0.0, 113.999}) {
      for (const double altitude : {-100.0, 0.0, 45.0, 9000.0}) {
        const Geodetic place = from_ecef(to_ecef({latitude, longitude, altitude}));
        EXPECT_NEAR(place.latitude_deg, latitude, 1e-12);
        EXPECT_NEAR(place.longitude_deg, longitude, 1e-12);
        EXPECT_NEAR(place.altitude_m, altitude, 1e-7);
      }
    }
  }
}

TEST(Geodetic, EnuPointsTheRightWay) {
  const Geodetic origin{22.5958, 113.999, 45.0};
  EXPECT_GT(from_enu(origin, {100, 0, 0}).longitude_deg, origin.longitude_deg);
  EXPECT_GT(from_enu(origin, {0, 100, 0}).latitude_deg, origin.latitude_deg);
  EXPECT_NEAR(from_enu(origin, {0, 0, 10}).altitude_m, 55.0, 1e-6);
  // Distances are kept.
  const auto a = to_ecef(from_enu(origin, {30, 40, 0}));
  EXPECT_NEAR((a - to_ecef(origin)).norm(), 50.0, 1e-6);
}

}  // namespace
}  // namespace camvox::simulation
