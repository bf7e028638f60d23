#include "kitti_oxts.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "camvox/import/kitti_raw.hpp"
#include "import_error.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

constexpr std::size_t kFields = 30;

Eigen::Vector3d vector_at(const std::vector<double>& values, std::size_t first) {
  return Eigen::Vector3d::Map(values.data() + first);
}

/// Yaw, pitch, roll in KITTI's order: R = Rz(yaw) Ry(pitch) Rx(roll).
Eigen::Quaterniond rotation(double roll_rad, double pitch_rad, double yaw_rad) {
  return Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(pitch_rad, Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(roll_rad, Eigen::Vector3d::UnitX());
}

template <typename Covariance>
void set_diagonal(Covariance& covariance, std::size_t side, std::size_t first, double variance) {
  for (std::size_t i = first; i < first + 3; ++i) covariance[i * side + i] = variance;
}

}  // namespace

MercatorPosition mercator(double latitude_deg, double longitude_deg, double latitude0_deg) {
  constexpr double kEarthRadius_m = 6378137.0;
  constexpr double kRadians = std::numbers::pi / 180.0;
  const double scale = std::cos(latitude0_deg * kRadians);
  return {scale * kEarthRadius_m * longitude_deg * kRadians,
          scale * kEarthRadius_m * std::log(std::tan((90.0 + latitude_deg) * kRadians / 2.0))};
}

OxtsSample read_oxts(const std::filesystem::path& path) {
  TextFile file(path);
  if (!file.next()) fail_corrupt(path, "is empty");
  const auto values = file.numbers(0, kFields);
  if (std::abs(values[0]) >= 90.0 || std::abs(values[1]) > 360.0) {
    file.fail("latitude or longitude is out of range");
  }
  OxtsSample sample;
  sample.latitude_deg = values[0];
  sample.longitude_deg = values[1];
  sample.altitude_m = values[2];
  sample.q_enu_imu = rotation(values[3], values[4], values[5]);
  sample.velocity_imu_mps = vector_at(values, 8);
  sample.acceleration_imu_mps2 = vector_at(values, 11);
  sample.rate_imu_radps = vector_at(values, 17);
  sample.position_sigma_m = values[23];
  sample.velocity_sigma_mps = values[24];
  sample.position_mode = static_cast<int>(std::clamp(values[27], 0.0, 100.0));
  return sample;
}

sensor_msgs::msg::Imu to_imu(std::int64_t stamp_ns, const OxtsSample& sample) {
  sensor_msgs::msg::Imu message;
  message.header(interfaces::to_header(stamp_ns, kImuFrame));
  message.orientation(to_message(sample.q_enu_imu));
  message.angular_velocity(to_message(sample.rate_imu_radps));
  message.linear_acceleration(to_message(sample.acceleration_imu_mps2));
  return message;
}

sensor_msgs::msg::NavSatFix to_fix(std::int64_t stamp_ns, const OxtsSample& sample) {
  constexpr int kFirstMode = 1, kFirstCorrectedMode = 4;
  constexpr std::int8_t kNoFix = -1, kFix = 0, kGroundAugmented = 2;
  constexpr std::uint16_t kGps = 1;
  constexpr std::uint8_t kApproximated = 1;
  sensor_msgs::msg::NavSatFix message;
  message.header(interfaces::to_header(stamp_ns, kImuFrame));
  message.status().status(sample.position_mode >= kFirstCorrectedMode ? kGroundAugmented
                          : sample.position_mode >= kFirstMode        ? kFix
                                                                      : kNoFix);
  message.status().service(kGps);
  message.latitude(sample.latitude_deg);
  message.longitude(sample.longitude_deg);
  message.altitude(sample.altitude_m);
  set_diagonal(
      message.position_covariance(), 3, 0, sample.position_sigma_m * sample.position_sigma_m);
  message.position_covariance_type(kApproximated);
  return message;
}

nav_msgs::msg::Odometry OxtsGroundTruth::to_odometry(std::int64_t stamp_ns,
                                                     const OxtsSample& sample) {
  if (!origin_m_) latitude0_deg_ = sample.latitude_deg;
  const auto position = mercator(sample.latitude_deg, sample.longitude_deg, latitude0_deg_);
  const Eigen::Vector3d p_m(position.east_m, position.north_m, sample.altitude_m);
  if (!origin_m_) origin_m_ = p_m;
  Eigen::Isometry3d T_map_base(sample.q_enu_imu);
  T_map_base.pretranslate(p_m - *origin_m_);
  auto message = make_odometry(stamp_ns, kBaseFrame, T_map_base);
  message.twist().twist().linear(to_message(sample.velocity_imu_mps));
  message.twist().twist().angular(to_message(sample.rate_imu_radps));
  const double variance_m2 = sample.position_sigma_m * sample.position_sigma_m;
  const double variance_m2ps2 = sample.velocity_sigma_mps * sample.velocity_sigma_mps;
  set_diagonal(message.pose().covariance(), 6, 0, variance_m2);
  set_diagonal(message.twist().covariance(), 6, 0, variance_m2ps2);
  return message;
}

}  // namespace camvox::import
