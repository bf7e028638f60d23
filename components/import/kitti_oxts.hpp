#pragma once

#include <array>
#include <filesystem>
#include <optional>

#include "messages.hpp"

namespace camvox::import {

/// One line of the GPS/IMU unit; axes x forward, y left, z up (oxts/dataformat.txt).
struct OxtsSample {
  double latitude_deg = 0.0;
  double longitude_deg = 0.0;
  double altitude_m = 0.0;
  Eigen::Quaterniond q_enu_imu = Eigen::Quaterniond::Identity();  ///< Yaw 0 is east.
  Eigen::Vector3d velocity_imu_mps = Eigen::Vector3d::Zero();
  Eigen::Vector3d acceleration_imu_mps2 = Eigen::Vector3d::Zero();  ///< Specific force.
  Eigen::Vector3d rate_imu_radps = Eigen::Vector3d::Zero();
  double position_sigma_m = 0.0;
  double velocity_sigma_mps = 0.0;
  int position_mode = 0;  ///< 0: none, 1 to 3: satellites only, 4 and up: with corrections.
};
[[nodiscard]] OxtsSample read_oxts(const std::filesystem::path& path);

[[nodiscard]] sensor_msgs::msg::Imu to_imu(std::int64_t stamp_ns, const OxtsSample& sample);
[[nodiscard]] sensor_msgs::msg::NavSatFix to_fix(std::int64_t stamp_ns, const OxtsSample& sample);

/// Poses in a map whose origin is the first sample that it is given.
class OxtsGroundTruth {
 public:
  [[nodiscard]] nav_msgs::msg::Odometry to_odometry(std::int64_t stamp_ns,
                                                    const OxtsSample& sample);

 private:
  std::optional<Eigen::Vector3d> origin_m_;
  double latitude0_deg_ = 0.0;
};

}  // namespace camvox::import
