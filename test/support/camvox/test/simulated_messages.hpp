#pragma once

#include <cstdint>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/simulation/simulator.hpp"

/// What the simulator made, as sync reads it from drivers.
namespace camvox::test {

template <typename Message>
void set_stamp(Message& message, std::int64_t stamp_ns) {
  message.header().stamp().sec(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
  message.header().stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
}

inline livox_ros_driver2::msg::CustomMsg to_message(const simulation::LidarScan& scan) {
  livox_ros_driver2::msg::CustomMsg message;
  set_stamp(message, scan.stamp_ns);
  message.timebase(static_cast<std::uint64_t>(scan.stamp_ns));
  for (const auto& simulated : scan.points) {
    auto& point = message.points().emplace_back();
    point.offset_time(simulated.offset_ns);
    point.x(simulated.p_lidar.x());
    point.y(simulated.p_lidar.y());
    point.z(simulated.p_lidar.z());
    point.reflectivity(simulated.reflectivity);
    point.tag(simulated.tag);
    point.line(simulated.line);
  }
  return message;
}

inline sensor_msgs::msg::Imu to_message(const simulation::ImuSample& sample) {
  sensor_msgs::msg::Imu message;
  set_stamp(message, sample.stamp_ns);
  message.angular_velocity().x(sample.omega_rad_s.x());
  message.angular_velocity().y(sample.omega_rad_s.y());
  message.angular_velocity().z(sample.omega_rad_s.z());
  message.linear_acceleration().x(sample.force_m_s2.x());
  message.linear_acceleration().y(sample.force_m_s2.y());
  message.linear_acceleration().z(sample.force_m_s2.z());
  return message;
}

inline sensor_msgs::msg::Image to_message(const simulation::SimulatedFrame& frame) {
  sensor_msgs::msg::Image message;
  set_stamp(message, frame.stamp_ns);
  message.width(static_cast<std::uint32_t>(frame.image.width_px));
  message.height(static_cast<std::uint32_t>(frame.image.height_px));
  message.step(3 * message.width());
  message.encoding("rgb8");
  message.data().assign(frame.image.rgb.begin(), frame.image.rgb.end());
  return message;
}

}  // namespace camvox::test
