#include "camvox/sync_component/scan_output.hpp"

#include <algorithm>
#include <cmath>

#include "camvox/interfaces/header.hpp"
#include "camvox/sync_component/lidar_input.hpp"

namespace camvox::sync_component {

std::optional<sync::ImuSample> read_imu(const sensor_msgs::msg::Imu& imu, lidar::ForceUnit& unit) {
  const auto& rate = imu.angular_velocity();
  const auto& force = imu.linear_acceleration();
  const double norm = std::hypot(force.x(), force.y(), force.z());
  if (!std::isfinite(norm + rate.x() + rate.y() + rate.z())) return std::nullopt;
  unit.add(norm);
  const double unit_m_s2 = unit.factor_m_s2().value_or(1.0);
  return sync::ImuSample{interfaces::stamp_of(imu.header()),
                         {rate.x(), rate.y(), rate.z()},
                         {unit_m_s2 * force.x(), unit_m_s2 * force.y(), unit_m_s2 * force.z()}};
}

bool write_scan(const sync::Frame& frame,
                const sync::LidarBuffer& lidar,
                camvox_interfaces::msg::Scan& scan) {
  const std::size_t capacity = scan.points().size();
  auto* const rows = reinterpret_cast<float(*)[4]>(scan.points().data()->data());
  const auto cut = lidar.cut(frame.window,
                             {{rows, capacity},
                              {scan.point_offset_ns().data(), capacity},
                              {scan.point_line().data(), capacity}});
  scan.header().stamp_ns(cut.stamp_ns);
  scan.image_stamp_ns(frame.stamp_ns);
  const auto count = static_cast<std::uint32_t>(cut.count);
  scan.points_count(count);
  scan.point_offset_ns_count(count);
  scan.point_line_count(count);
  for (std::size_t i = 0; i < frame.imu.size(); ++i) {
    const auto& sample = frame.imu[i];
    scan.imu_stamp_ns()[i] = sample.stamp_ns;
    std::ranges::copy(sample.gyro_rad_s, scan.imu()[i].begin());
    std::ranges::copy(sample.force_m_s2, scan.imu()[i].begin() + 3);
  }
  scan.imu_stamp_ns_count(static_cast<std::uint32_t>(frame.imu.size()));
  scan.imu_count(static_cast<std::uint32_t>(frame.imu.size()));
  return !cut.over_capacity;
}

}  // namespace camvox::sync_component
