#pragma once

#include <cstdint>
#include <vector>

#include "camvox/trajectory/trajectory.hpp"

namespace camvox::trajectory {

/// A position on WGS 84.
struct GnssFix {
  std::int64_t stamp_ns = 0;
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;  ///< Above the ellipsoid.
};

/// The antenna's path in the local tangent plane (x east, y north, z up) of the first fix;
/// rotations are the identity. By GeographicLib. Fixes that are no place on Earth or do not come
/// after the one before are left out.
[[nodiscard]] Trajectory to_enu(const std::vector<GnssFix>& fixes);

}  // namespace camvox::trajectory
