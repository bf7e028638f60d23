#pragma once

#include <array>
#include <cstdint>

namespace camvox::dense {

using Rgb = std::array<std::uint8_t, 3>;

/// How the bytes of an image are to be read; the values of the message's ENCODING_*.
enum class Encoding : std::uint8_t {
  kMono8 = 0,
  kBgr8 = 1,
  kRgb8 = 2,
  kYuv420 = 3,  ///< Y plane, then U and V of half the size (rounded up); full range, as in JPEG.
};

/// An image that somebody else keeps.
struct ImageView {
  const std::uint8_t* data = nullptr;
  int width_px = 0;
  int height_px = 0;
  int row_step_bytes = 0;  ///< Of the first plane; the chroma planes have no gaps.
  Encoding encoding = Encoding::kMono8;
};

/// The colour of a pixel inside the image. YUV by ITU-T T.871 (JFIF), nearest chroma sample.
[[nodiscard]] Rgb colour_at(const ImageView& image, int u_px, int v_px);

}  // namespace camvox::dense
