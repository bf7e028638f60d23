#include "camvox/conversion/image.hpp"

#include <algorithm>

namespace camvox::conversion {
namespace {

namespace msg = camvox_interfaces::msg;
using msg::FrameImage;

std::uint8_t to_byte(int value) { return static_cast<std::uint8_t>(std::clamp(value, 0, 255)); }

/// Full range ITU-R BT.601, as in JPEG; coefficients in 1/65536.
std::array<std::uint8_t, 3> from_ycc(int y, int cb, int cr) {
  constexpr int kShift = 16, kHalf = 1 << (kShift - 1);
  return {to_byte(y + ((116130 * cb + kHalf) >> kShift)),
          to_byte(y - ((22554 * cb + 46802 * cr + kHalf) >> kShift)),
          to_byte(y + ((91881 * cr + kHalf) >> kShift))};
}

}  // namespace

bool is_well_formed(const FrameImage& image) {
  const std::size_t width = image.width_px(), height = image.height_px();
  const std::size_t step = image.row_step_bytes(), count = image.data_count();
  if (width == 0 || height == 0 || count > image.data().size()) return false;
  switch (image.encoding()) {
    case msg::ENCODING_MONO8:
      return step >= width && count >= step * (height - 1) + width;
    case msg::ENCODING_BGR8:
    case msg::ENCODING_RGB8:
      return step >= 3 * width && count >= step * (height - 1) + 3 * width;
    case msg::ENCODING_YUV420: {
      const std::size_t rows = (height + 1) / 2, columns = (width + 1) / 2;
      return step >= width && count >= step * 2 * rows + 2 * rows * columns;
    }
    default:
      return false;
  }
}

std::optional<GreyView> grey_view(const FrameImage& image) {
  const auto encoding = image.encoding();
  const bool grey = encoding == msg::ENCODING_MONO8 || encoding == msg::ENCODING_YUV420;
  if (!grey || !is_well_formed(image)) return std::nullopt;
  return GreyView{image.data().data(),
                  static_cast<int>(image.width_px()),
                  static_cast<int>(image.height_px()),
                  image.row_step_bytes()};
}

std::array<std::uint8_t, 3> bgr_at(const FrameImage& image, int u_px, int v_px) {
  const auto u = static_cast<std::size_t>(u_px), v = static_cast<std::size_t>(v_px);
  const auto* row = image.data().data() + v * image.row_step_bytes();
  switch (image.encoding()) {
    case msg::ENCODING_BGR8:
      return {row[3 * u], row[3 * u + 1], row[3 * u + 2]};
    case msg::ENCODING_RGB8:
      return {row[3 * u + 2], row[3 * u + 1], row[3 * u]};
    case msg::ENCODING_YUV420: {
      const std::size_t rows = (image.height_px() + 1) / 2, columns = (image.width_px() + 1) / 2;
      const auto* cb =
          image.data().data() + image.row_step_bytes() * 2 * rows + v / 2 * columns + u / 2;
      return from_ycc(row[u], cb[0] - 128, cb[rows * columns] - 128);
    }
    default:
      return {row[u], row[u], row[u]};
  }
}

}  // namespace camvox::conversion
