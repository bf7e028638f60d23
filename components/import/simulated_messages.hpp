#pragma once

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/imu_noise.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/simulator.hpp"
#include "messages.hpp"

/// What the simulator made, as the messages of ROS 2 drivers.
namespace camvox::import {

inline constexpr const char* kWorldFrame = "world";
inline constexpr const char* kGnssFrame = "gnss_link";

[[nodiscard]] sensor_msgs::msg::Image to_image(const simulation::SimulatedFrame& frame);
[[nodiscard]] sensor_msgs::msg::CameraInfo to_camera_info(std::int64_t stamp_ns,
                                                          const sensors::CameraIntrinsics& camera);
[[nodiscard]] sensor_msgs::msg::Image to_depth_image(const simulation::SimulatedFrame& frame);

[[nodiscard]] livox_ros_driver2::msg::CustomMsg to_livox(const simulation::LidarScan& scan);
/// Fields x y z (lidar frame at the scan's stamp) and the flags mixed and moving.
[[nodiscard]] sensor_msgs::msg::PointCloud2 to_truth_points(const simulation::LidarScan& scan);

/// `variance` of both sensors, per axis.
[[nodiscard]] sensor_msgs::msg::Imu to_imu(const simulation::ImuSample& sample,
                                           double gyro_variance,
                                           double accel_variance);
[[nodiscard]] sensor_msgs::msg::Imu to_bias(const simulation::ImuSample& sample);
[[nodiscard]] sensor_msgs::msg::NavSatFix to_fix(const simulation::GnssSample& sample);
/// The pose in world, the twist in the body.
[[nodiscard]] nav_msgs::msg::Odometry to_odometry(const simulation::TruthState& truth);
/// base_link to all sensors.
[[nodiscard]] tf2_msgs::msg::TFMessage to_transforms(std::int64_t stamp_ns,
                                                     const sensors::RigCalibration& rig);

}  // namespace camvox::import
