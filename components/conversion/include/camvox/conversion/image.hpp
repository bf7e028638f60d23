#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::conversion {

/// Grey pixels where they lie in a message.
struct GreyView {
  const std::uint8_t* data = nullptr;
  int width_px = 0;
  int height_px = 0;
  std::size_t row_step_bytes = 0;
};

/// The brightness of a frame image, without a copy: the image itself (MONO8) or its Y plane
/// (YUV420). Nothing for interleaved colours, unknown encodings, and images whose sizes do not add
/// up.
[[nodiscard]] std::optional<GreyView> grey_view(const camvox_interfaces::msg::FrameImage& image);

/// Blue, green, red of a pixel, from any encoding; grey three times where there is no colour. The
/// image must be well-formed (`is_well_formed`), and the pixel inside it.
[[nodiscard]] std::array<std::uint8_t, 3> bgr_at(const camvox_interfaces::msg::FrameImage& image,
                                                 int u_px,
                                                 int v_px);

/// Whether an image's encoding is known and all its pixels are in its counted data.
[[nodiscard]] bool is_well_formed(const camvox_interfaces::msg::FrameImage& image);

}  // namespace camvox::conversion
