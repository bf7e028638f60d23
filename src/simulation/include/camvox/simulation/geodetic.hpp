#pragma once

#include <Eigen/Core>

namespace camvox::simulation {

/// A place on the WGS 84 ellipsoid.
struct Geodetic {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;  ///< Above the ellipsoid.
};

/// Earth-centred, earth-fixed coordinates (closed form).
[[nodiscard]] Eigen::Vector3d to_ecef(const Geodetic& place);

/// The inverse of to_ecef: Bowring's iteration, better than 1e-9 m up to 10 km of altitude.
[[nodiscard]] Geodetic from_ecef(const Eigen::Vector3d& p_ecef);

/// The place at `p_enu` (east, north, up; metres) from `origin`.
[[nodiscard]] Geodetic from_enu(const Geodetic& origin, const Eigen::Vector3d& p_enu);

}  // namespace camvox::simulation
