#include "messages.hpp"

#include <bit>
#include <cstring>

namespace camvox::import {

static_assert(std::endian::native == std::endian::little, "image data are stored little-endian");

sensor_msgs::msg::CompressedImage make_compressed_image(std::int64_t stamp_ns,
                                                        const std::string& format,
                                                        std::vector<std::uint8_t> bytes) {
  sensor_msgs::msg::CompressedImage message;
  message.header(interfaces::to_header(stamp_ns, kCameraFrame));
  message.format(format);
  message.data(std::move(bytes));
  return message;
}

sensor_msgs::msg::Image make_depth_image(std::int64_t stamp_ns,
                                         int width_px,
                                         int height_px,
                                         std::span<const std::uint16_t> depth_mm) {
  sensor_msgs::msg::Image message;
  message.header(interfaces::to_header(stamp_ns, kCameraFrame));
  message.width(static_cast<std::uint32_t>(width_px));
  message.height(static_cast<std::uint32_t>(height_px));
  message.encoding("16UC1");
  message.step(static_cast<std::uint32_t>(width_px) * 2);
  message.data().resize(depth_mm.size_bytes());
  std::memcpy(message.data().data(), depth_mm.data(), depth_mm.size_bytes());
  return message;
}

sensor_msgs::msg::CameraInfo make_camera_info(std::int64_t stamp_ns, const CameraModel& camera) {
  const double fx = camera.fx_px, fy = camera.fy_px, cx = camera.cx_px, cy = camera.cy_px;
  sensor_msgs::msg::CameraInfo message;
  message.header(interfaces::to_header(stamp_ns, kCameraFrame));
  message.width(static_cast<std::uint32_t>(camera.width_px));
  message.height(static_cast<std::uint32_t>(camera.height_px));
  message.distortion_model("plumb_bob");
  message.d(camera.plumb_bob);
  message.k({fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0});
  message.r({1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0});
  message.p({fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0});
  return message;
}

geometry_msgs::msg::Quaternion to_message(const Eigen::Quaterniond& rotation) {
  geometry_msgs::msg::Quaternion message;
  message.x(rotation.x());
  message.y(rotation.y());
  message.z(rotation.z());
  message.w(rotation.w());
  return message;
}

geometry_msgs::msg::Vector3 to_message(const Eigen::Vector3d& vector) {
  geometry_msgs::msg::Vector3 message;
  message.x(vector.x());
  message.y(vector.y());
  message.z(vector.z());
  return message;
}

nav_msgs::msg::Odometry make_odometry(std::int64_t stamp_ns,
                                      const std::string& child,
                                      const Eigen::Isometry3d& T_map_child) {
  nav_msgs::msg::Odometry message;
  message.header(interfaces::to_header(stamp_ns, kMapFrame));
  message.child_frame_id(child);
  auto& pose = message.pose().pose();
  pose.position().x(T_map_child.translation().x());
  pose.position().y(T_map_child.translation().y());
  pose.position().z(T_map_child.translation().z());
  pose.orientation(to_message(Eigen::Quaterniond(T_map_child.rotation())));
  return message;
}

geometry_msgs::msg::TransformStamped make_transform(std::int64_t stamp_ns,
                                                    const std::string& parent,
                                                    const std::string& child,
                                                    const Eigen::Isometry3d& T_parent_child) {
  geometry_msgs::msg::TransformStamped message;
  message.header(interfaces::to_header(stamp_ns, parent));
  message.child_frame_id(child);
  message.transform().translation(to_message(Eigen::Vector3d(T_parent_child.translation())));
  message.transform().rotation(to_message(Eigen::Quaterniond(T_parent_child.rotation())));
  return message;
}

Eigen::Isometry3d T_body_optical() {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return T;
}

sensor_msgs::msg::PointField float_field(const std::string& name, std::uint32_t offset) {
  constexpr std::uint8_t kFloat32 = 7;
  sensor_msgs::msg::PointField field;
  field.name(name);
  field.offset(offset);
  field.datatype(kFloat32);
  field.count(1);
  return field;
}

}  // namespace camvox::import
