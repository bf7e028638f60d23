#pragma once

#include <cstdint>
#include <string>

#include "camvox/interfaces/std_msgs.hpp"

/// Between the header of ROS messages and our stamps, ns since the epoch.
namespace camvox::interfaces {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;

/// A ROS header of a moment at or after the epoch, in a frame.
[[nodiscard]] inline std_msgs::msg::Header to_header(std::int64_t stamp_ns,
                                                     const std::string& frame) {
  std_msgs::msg::Header header;
  header.stamp().sec(static_cast<std::int32_t>(stamp_ns / kSecond_ns));
  header.stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % kSecond_ns));
  header.frame_id(frame);
  return header;
}

/// Nanoseconds of a message's header.
[[nodiscard]] inline std::int64_t stamp_of(const std_msgs::msg::Header& header) {
  return kSecond_ns * header.stamp().sec() + header.stamp().nanosec();
}

}  // namespace camvox::interfaces
