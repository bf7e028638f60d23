#include "camvox/dense/image_view.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace camvox::dense {
namespace {

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(std::lround(value), 0L, 255L));
}

Rgb from_yuv(float y, float u, float v) {
  const float cb = u - 128.0F;
  const float cr = v - 128.0F;
  return {to_byte(y + 1.402F * cr),
          to_byte(y - 0.344136F * cb - 0.714136F * cr),
          to_byte(y + 1.772F * cb)};
}

}  // namespace

Rgb colour_at(const ImageView& image, int u_px, int v_px) {
  const auto row = static_cast<std::size_t>(v_px) * static_cast<std::size_t>(image.row_step_bytes);
  const auto u = static_cast<std::size_t>(u_px);
  switch (image.encoding) {
    case Encoding::kBgr8: {
      const auto* pixel = image.data + row + 3 * u;
      return {pixel[2], pixel[1], pixel[0]};
    }
    case Encoding::kRgb8: {
      const auto* pixel = image.data + row + 3 * u;
      return {pixel[0], pixel[1], pixel[2]};
    }
    case Encoding::kYuv420: {
      const auto half_width = static_cast<std::size_t>((image.width_px + 1) / 2);
      const auto half_height = static_cast<std::size_t>((image.height_px + 1) / 2);
      const auto* plane_u = image.data + static_cast<std::size_t>(image.row_step_bytes) *
                                             static_cast<std::size_t>(image.height_px);
      const auto* plane_v = plane_u + half_width * half_height;
      const auto chroma = static_cast<std::size_t>(v_px / 2) * half_width + u / 2;
      return from_yuv(image.data[row + u], plane_u[chroma], plane_v[chroma]);
    }
    case Encoding::kMono8:
      break;
  }
  const auto grey = image.data[row + u];
  return {grey, grey, grey};
}

}  // namespace camvox::dense
