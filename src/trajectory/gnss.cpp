#include "camvox/trajectory/gnss.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <cmath>

namespace camvox::trajectory {
namespace {

bool is_place(const GnssFix& fix) {
  return std::abs(fix.latitude_deg) <= 90.0 && std::abs(fix.longitude_deg) <= 540.0 &&
         std::isfinite(fix.altitude_m);
}

}  // namespace

Trajectory to_enu(const std::vector<GnssFix>& fixes) {
  Trajectory trajectory;
  GeographicLib::LocalCartesian plane;
  for (const auto& fix : fixes) {
    if (!is_place(fix)) continue;
    if (trajectory.empty()) plane.Reset(fix.latitude_deg, fix.longitude_deg, fix.altitude_m);
    if (!trajectory.empty() && fix.stamp_ns <= trajectory.back().stamp_ns) continue;
    Eigen::Vector3d p_enu;
    plane.Forward(
        fix.latitude_deg, fix.longitude_deg, fix.altitude_m, p_enu[0], p_enu[1], p_enu[2]);
    trajectory.push_back({fix.stamp_ns, {geometry::SO3(), p_enu}});
  }
  return trajectory;
}

}  // namespace camvox::trajectory
