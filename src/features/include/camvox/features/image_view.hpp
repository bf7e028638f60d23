#pragma once

#include <cstddef>
#include <cstdint>

namespace camvox::features {

/// A grey image that someone else owns. The rows of the image lie in one piece of memory.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width_px = 0;
  int height_px = 0;
  std::ptrdiff_t step_bytes = 0;  ///< From one row to the next, at least width_px.

  [[nodiscard]] const std::uint8_t* row(int v) const { return data + v * step_bytes; }
  [[nodiscard]] const std::uint8_t* at(int u, int v) const { return row(v) + u; }
};

}  // namespace camvox::features
