#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"

namespace camvox::sensors {

/// A rigid transform as it stands in a YAML file.
struct TransformConfig {
  std::vector<double> translation_m = {0.0, 0.0, 0.0};       ///< x y z.
  std::vector<double> rotation_xyzw = {0.0, 0.0, 0.0, 1.0};  ///< Unit quaternion, w last as in ROS.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("translation_m", self.translation_m, config::at_least(-1e3), config::at_most(1e3));
    field("rotation_xyzw", self.rotation_xyzw, config::at_least(-1.0), config::at_most(1.0));
  }
};

/// Where the sensors sit on the robot, as parameters. The defaults are the CamVox rig: lidar to
/// camera as in its depth projection (axes swapped, no further rotation; translation -8.3, -2.2,
/// 7.3 cm in camera axes), IMU 10 cm from the lidar. How the rig is mounted is our choice: body is
/// on the ground below the robot's centre (x forward, z up), camera 0.9 m up and 0.2 m ahead.
struct RigConfig {
  TransformConfig T_body_camera{{0.2, 0.0, 0.9}, {-0.5, 0.5, -0.5, 0.5}};
  TransformConfig T_lidar_camera{{-0.0727962, -0.082984, -0.0221759}, {-0.5, 0.5, -0.5, 0.5}};
  TransformConfig T_imu_lidar{{0.0, 0.0, 0.1}, {0.0, 0.0, 0.0, 1.0}};
  std::vector<double> p_body_gnss_m = {-0.1, 0.0, 1.3};  ///< Antenna phase centre.
  std::int64_t camera_time_offset_ns = 0;  ///< Add to a camera stamp to get lidar time.
  std::int64_t imu_time_offset_ns = 0;     ///< Add to an IMU stamp to get lidar time.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("T_body_camera", self.T_body_camera);
    field("T_lidar_camera", self.T_lidar_camera);
    field("T_imu_lidar", self.T_imu_lidar);
    field("p_body_gnss_m", self.p_body_gnss_m, config::at_least(-1e3), config::at_most(1e3));
    field("camera_time_offset_ns", self.camera_time_offset_ns);
    field("imu_time_offset_ns", self.imu_time_offset_ns);
  }
};

/// Where the sensors sit on the robot, ready to compute with.
struct RigCalibration {
  geometry::SE3 T_body_camera;
  geometry::SE3 T_lidar_camera;
  geometry::SE3 T_imu_lidar;
  Eigen::Vector3d p_body_gnss = Eigen::Vector3d::Zero();
  std::int64_t camera_time_offset_ns = 0;  ///< Add to a camera stamp to get lidar time.
  std::int64_t imu_time_offset_ns = 0;     ///< Add to an IMU stamp to get lidar time.

  [[nodiscard]] geometry::SE3 T_camera_lidar() const { return T_lidar_camera.inverse(); }
  [[nodiscard]] geometry::SE3 T_body_lidar() const { return T_body_camera * T_camera_lidar(); }
  [[nodiscard]] geometry::SE3 T_body_imu() const { return T_body_lidar() * T_imu_lidar.inverse(); }
};

/// Everything that is wrong with `rig`: constraints, array lengths, quaternions not of unit norm.
[[nodiscard]] std::vector<config::Problem> check(const RigConfig& rig,
                                                 const std::string& origin = "rig");

/// Throws config::ConfigError with all problems of `rig`.
[[nodiscard]] RigCalibration make_rig_calibration(const RigConfig& rig = {});

/// The inverse of make_rig_calibration.
[[nodiscard]] RigConfig to_config(const RigCalibration& rig);

}  // namespace camvox::sensors
