#pragma once

#include <cstdint>
#include <string>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"

namespace camvox::test {

inline constexpr std::int64_t kMs = 1'000'000;
inline constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

template <typename Message>
void set_stamp(Message& message, std::int64_t stamp_ns) {
  message.header().stamp().sec(static_cast<std::int32_t>(stamp_ns / 1'000'000'000));
  message.header().stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % 1'000'000'000));
}

/// A grey image of one brightness.
inline sensor_msgs::msg::Image grey_image(std::int64_t stamp_ns,
                                          std::uint32_t width_px,
                                          std::uint32_t height_px,
                                          std::uint8_t brightness = 100) {
  sensor_msgs::msg::Image image;
  set_stamp(image, stamp_ns);
  image.width(width_px);
  image.height(height_px);
  image.step(width_px);
  image.encoding("mono8");
  image.data().assign(std::size_t{width_px} * height_px, brightness);
  return image;
}

/// Returns every `step_ns` from the stamp on. The x coordinate of each is its time in ms after
/// kStart_ns, so that a test can see which return it was.
inline livox_ros_driver2::msg::CustomMsg livox_message(std::int64_t stamp_ns,
                                                       std::int64_t duration_ns,
                                                       std::int64_t step_ns = kMs) {
  livox_ros_driver2::msg::CustomMsg message;
  set_stamp(message, stamp_ns);
  message.timebase(static_cast<std::uint64_t>(stamp_ns));
  for (std::int64_t offset_ns = 0; offset_ns < duration_ns; offset_ns += step_ns) {
    livox_ros_driver2::msg::CustomPoint point;
    point.offset_time(static_cast<std::uint32_t>(offset_ns));
    point.x(static_cast<float>(static_cast<double>(stamp_ns + offset_ns - kStart_ns) / kMs) +
            1000.0F);
    point.y(1.0F);
    point.z(2.0F);
    point.reflectivity(50);
    point.tag(0);
    point.line(3);
    message.points().push_back(point);
  }
  message.point_num(static_cast<std::uint32_t>(message.points().size()));
  return message;
}

inline sensor_msgs::msg::Imu imu_message(std::int64_t stamp_ns, double force_z = 9.81) {
  sensor_msgs::msg::Imu imu;
  set_stamp(imu, stamp_ns);
  imu.angular_velocity().z(0.001);
  imu.linear_acceleration().z(force_z);
  return imu;
}

}  // namespace camvox::test
