#include "camvox/sync_component/image_input.hpp"

namespace camvox::sync_component {
namespace {

namespace msg = camvox_interfaces::msg;

sync::PixelFormat format_of(const std::string& encoding) {
  if (encoding == "bgr8") return sync::PixelFormat::kBgr8;
  if (encoding == "yuv420") return sync::PixelFormat::kYuv420;
  return sync::PixelFormat::kMono8;
}

std::uint8_t code_of(sync::PixelFormat format) {
  if (format == sync::PixelFormat::kBgr8) return msg::ENCODING_BGR8;
  return format == sync::PixelFormat::kYuv420 ? msg::ENCODING_YUV420 : msg::ENCODING_MONO8;
}

}  // namespace

ImageInput::ImageInput(const sensors::CameraIntrinsics& camera, const std::string& encoding)
    : width_px_(camera.width_px), height_px_(camera.height_px), format_(format_of(encoding)) {}

sync::ImageTarget ImageInput::prepare(msg::FrameImage& frame) const {
  frame.width_px(static_cast<std::uint32_t>(width_px_));
  frame.height_px(static_cast<std::uint32_t>(height_px_));
  frame.row_step_bytes(static_cast<std::uint32_t>(sync::row_step_bytes(width_px_, format_)));
  frame.encoding(code_of(format_));
  return {{frame.data().data(), frame.data().size()}, width_px_, height_px_, format_};
}

std::string ImageInput::read(const sensor_msgs::msg::Image& image, msg::FrameImage& frame) {
  const auto target = prepare(frame);
  auto problem = decoder_.convert({image.encoding(),
                                   static_cast<int>(image.width()),
                                   static_cast<int>(image.height()),
                                   image.step(),
                                   image.data()},
                                  target);
  if (!problem.empty()) return problem;
  frame.data_count(static_cast<std::uint32_t>(sync::image_bytes(width_px_, height_px_, format_)));
  return {};
}

std::string ImageInput::read(const sensor_msgs::msg::CompressedImage& image,
                             msg::FrameImage& frame) {
  const auto target = prepare(frame);
  auto problem = decoder_.decode(image.data(), target);
  if (!problem.empty()) return problem;
  frame.data_count(static_cast<std::uint32_t>(sync::image_bytes(width_px_, height_px_, format_)));
  return {};
}

}  // namespace camvox::sync_component
