#pragma once

#include <cstdint>
#include <string>

#include "camvox/interfaces/std_msgs.hpp"

namespace camvox::conversion {

/// A ROS header of a moment, ns since the epoch, in a frame.
[[nodiscard]] inline std_msgs::msg::Header to_header(std::int64_t stamp_ns,
                                                     const std::string& frame) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  std_msgs::msg::Header header;
  header.stamp().sec(static_cast<std::int32_t>(stamp_ns / kSecond_ns));
  header.stamp().nanosec(static_cast<std::uint32_t>(stamp_ns % kSecond_ns));
  header.frame_id(frame);
  return header;
}

}  // namespace camvox::conversion
