#pragma once

#include <cmath>
#include <cstdint>

namespace camvox::lidar {

/// How sure a Livox lidar must be that a return is noise for it to be left out. The values are
/// those of the tag's two-bit fields (Livox SDK communication protocol, "tag information").
enum class NoiseConfidence : std::uint8_t { kKeepAll = 0, kHigh = 1, kModerate = 2, kLow = 3 };

/// Whether a return is to be kept: not the (0, 0, 0) of a shot without an echo, a number, and not
/// noise by its tag. Bits 0-1 of a tag judge by position (2: blend of two surfaces at an edge,
/// rain, fog), bits 2-3 by intensity; in both 0 is normal, and 1 to 3 are noise with high, moderate
/// and low confidence. With `noise` kModerate returns of high and moderate confidence are left out.
[[nodiscard]] inline bool keep_livox_return(
    float x_m, float y_m, float z_m, std::uint8_t tag, NoiseConfidence noise) {
  const auto is_noise = [noise](std::uint8_t field) {
    return field != 0 && field <= static_cast<std::uint8_t>(noise);
  };
  if (is_noise(tag & 3U) || is_noise((tag >> 2U) & 3U)) return false;
  const float range_m2 = x_m * x_m + y_m * y_m + z_m * z_m;
  return range_m2 > 0.0F && std::isfinite(range_m2);
}

}  // namespace camvox::lidar
