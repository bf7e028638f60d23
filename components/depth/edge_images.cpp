#include "edge_images.hpp"

#include <cmath>
#include <cstring>

#include "camvox/interfaces/header.hpp"

namespace camvox::depth_component {
namespace {

using camvox_interfaces::msg::DepthImage;
using sensor_msgs::msg::Image;

constexpr float kMaxMillimetres = 65535.0F;

std_msgs::msg::Header header_of(const DepthImage& depth) {
  return interfaces::to_header(depth.header().stamp_ns(), kCameraFrame);
}

/// Everything but the pixels; those are `bytes` each, all zero.
void write_frame(const DepthImage& depth, const char* encoding, std::uint32_t bytes, Image& image) {
  image.header(header_of(depth));
  image.width(depth.width_px());
  image.height(depth.height_px());
  image.encoding(encoding);
  image.is_bigendian(0);
  image.step(bytes * depth.width_px());
  image.data().assign(std::size_t{image.step()} * depth.height_px(), 0);
}

}  // namespace

void write_metres(const DepthImage& depth, Image& image) {
  write_frame(depth, "32FC1", 4, image);
  std::memcpy(image.data().data(), depth.depth_m().data(), 4 * std::size_t{depth.depth_m_count()});
}

void write_millimetres(const DepthImage& depth, Image& image) {
  write_frame(depth, "16UC1", 2, image);
  auto* out = image.data().data();
  for (std::uint32_t i = 0; i < depth.depth_m_count(); ++i, out += 2) {
    const float millimetres = std::round(1e3F * depth.depth_m()[i]);
    const auto value = static_cast<std::uint16_t>(millimetres <= kMaxMillimetres ? millimetres : 0);
    std::memcpy(out, &value, 2);
  }
}

void write_camera_info(const DepthImage& depth,
                       const sensors::CameraIntrinsics& camera,
                       sensor_msgs::msg::CameraInfo& info) {
  const double fx = camera.fx_px;
  const double fy = camera.fy_px;
  const double cx = camera.cx_px;
  const double cy = camera.cy_px;
  info.header(header_of(depth));
  info.width(depth.width_px());
  info.height(depth.height_px());
  info.distortion_model(camera.distortion_model);
  info.d(camera.distortion);
  info.k({fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});
  info.r({1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  info.p({fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});
}

}  // namespace camvox::depth_component
