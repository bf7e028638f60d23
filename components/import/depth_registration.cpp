#include "camvox/import/depth_registration.hpp"

#include <cmath>
#include <stdexcept>

namespace camvox::import {
namespace {

constexpr std::uint16_t kNone = 0;
constexpr std::uint16_t kInvalid = 65535;

/// Pixels of an image of this size.
std::size_t pixels(const Pinhole& camera) {
  return static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
}

}  // namespace

std::vector<std::uint16_t> register_depth(const DepthRegistration& rig,
                                          std::span<const std::uint16_t> depth_mm) {
  const auto& from = rig.depth;
  const auto& to = rig.camera;
  const auto& offset_m = rig.p_camera_depth_m;
  if (depth_mm.size() != pixels(from)) throw std::logic_error("depth image of another size");
  std::vector<std::uint16_t> registered(pixels(to), kNone);
  std::size_t at = 0;
  for (int v = 0; v < from.height_px; ++v) {
    for (int u = 0; u < from.width_px; ++u, ++at) {
      if (depth_mm[at] == kNone || depth_mm[at] == kInvalid) continue;
      const double depth_m = 1e-3 * depth_mm[at];
      const double x_m = (u - from.cx_px) / from.fx_px * depth_m + offset_m[0];
      const double y_m = (v - from.cy_px) / from.fy_px * depth_m + offset_m[1];
      const double z_m = depth_m + offset_m[2];
      if (z_m <= 0.0) continue;
      const double u_px = std::round(to.fx_px * x_m / z_m + to.cx_px);
      const double v_px = std::round(to.fy_px * y_m / z_m + to.cy_px);
      if (!(u_px >= 0.0 && u_px < to.width_px && v_px >= 0.0 && v_px < to.height_px)) continue;
      const double z_mm = std::round(1e3 * z_m);
      if (z_mm < 1.0 || z_mm >= kInvalid) continue;
      auto& nearest =
          registered[static_cast<std::size_t>(v_px) * static_cast<std::size_t>(to.width_px) +
                     static_cast<std::size_t>(u_px)];
      if (nearest == kNone || z_mm < nearest) nearest = static_cast<std::uint16_t>(z_mm);
    }
  }
  return registered;
}

}  // namespace camvox::import
