#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace camvox::simulation {

/// A colour image, rows from the top, 3 bytes red green blue per pixel, no padding.
struct ColorImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<std::uint8_t> rgb;
};

/// Depth of every pixel: z along the optical axis in metres, 0 where nothing is seen (sky).
struct DepthImage {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> z_m;

  [[nodiscard]] float at(int column, int row) const {
    return z_m[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px) +
               static_cast<std::size_t>(column)];
  }
};

}  // namespace camvox::simulation
