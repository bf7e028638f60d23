#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "camvox/interfaces/geometry_msgs.hpp"
#include "camvox/interfaces/header.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/interfaces/topics.hpp"

/// Standard messages as all importers fill them.
namespace camvox::import {

// Frames (REP-103, REP-105, REP-145).
inline constexpr const char* kMapFrame = "map";
inline constexpr const char* kBaseFrame = "base_link";
inline constexpr const char* kImuFrame = "imu_link";
inline constexpr const char* kCameraFrame = "camera_optical_frame";
inline constexpr const char* kLivoxFrame = "livox_frame";  // as livox_ros_driver2 names it

// Topics that topics.hpp has no name for: only recordings carry them.
inline constexpr std::string_view kGroundTruthTopic = "/ground_truth/odometry";
inline constexpr std::string_view kDepthTopic = interfaces::topics::kRegisteredDepth;

/// A JPEG or PNG as it is in its file.
[[nodiscard]] sensor_msgs::msg::CompressedImage make_compressed_image(
    std::int64_t stamp_ns, const std::string& format, std::vector<std::uint8_t> bytes);

/// 16UC1: millimetres along the optical axis, 0 where there is none (REP-118).
[[nodiscard]] sensor_msgs::msg::Image make_depth_image(std::int64_t stamp_ns,
                                                       int width_px,
                                                       int height_px,
                                                       std::span<const std::uint16_t> depth_mm);

/// A pinhole camera.
struct CameraModel {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  std::vector<double> plumb_bob = std::vector<double>(5, 0.0);  ///< k1 k2 p1 p2 k3.
};
[[nodiscard]] sensor_msgs::msg::CameraInfo make_camera_info(std::int64_t stamp_ns,
                                                            const CameraModel& camera);

[[nodiscard]] geometry_msgs::msg::Quaternion to_message(const Eigen::Quaterniond& rotation);
[[nodiscard]] geometry_msgs::msg::Vector3 to_message(const Eigen::Vector3d& vector);

/// The pose of `child` in kMapFrame; no twist.
[[nodiscard]] nav_msgs::msg::Odometry make_odometry(std::int64_t stamp_ns,
                                                    const std::string& child,
                                                    const Eigen::Isometry3d& T_map_child);

[[nodiscard]] geometry_msgs::msg::TransformStamped make_transform(
    std::int64_t stamp_ns,
    const std::string& parent,
    const std::string& child,
    const Eigen::Isometry3d& T_parent_child);

/// Turns a camera's optical axes (z forward, x right, y down) into a body's (x forward, y left,
/// z up): REP-103.
[[nodiscard]] Eigen::Isometry3d T_body_optical();

/// A float32 field of a PointCloud2 at its place in the point.
[[nodiscard]] sensor_msgs::msg::PointField float_field(const std::string& name,
                                                       std::uint32_t offset);

}  // namespace camvox::import
