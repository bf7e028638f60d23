#pragma once

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::depth_component {

inline constexpr auto kCameraFrame = "camera_optical_frame";

/// A depth image as ROS has it (REP-118): 32FC1 in metres, 0 for none; 16UC1 in whole millimetres,
/// 0 for none and for more than 65.5 m.
void write_metres(const camvox_interfaces::msg::DepthImage& depth, sensor_msgs::msg::Image& image);
void write_millimetres(const camvox_interfaces::msg::DepthImage& depth,
                       sensor_msgs::msg::Image& image);
/// What belongs to either.
void write_camera_info(const camvox_interfaces::msg::DepthImage& depth,
                       const sensors::CameraIntrinsics& camera,
                       sensor_msgs::msg::CameraInfo& info);

}  // namespace camvox::depth_component
