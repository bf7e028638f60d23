#include "camvox/sync_component/lidar_input.hpp"

#include <algorithm>

#include "camvox/interfaces/header.hpp"

namespace camvox::sync_component {

std::string read_livox(const livox_ros_driver2::msg::CustomMsg& message,
                       const LidarInputOptions& options,
                       sync::LidarChunk& chunk) {
  const std::int64_t header_ns = interfaces::stamp_of(message.header());
  const auto timebase_ns = static_cast<std::int64_t>(message.timebase());
  const bool same_clock = timebase_ns > 0 && (header_ns == 0 || std::abs(timebase_ns - header_ns) <=
                                                                    options.clock_jump_ns);
  chunk.stamp_ns = same_clock ? timebase_ns : header_ns;
  chunk.has_point_times = true;
  chunk.returns.clear();
  chunk.returns.reserve(message.points().size());
  std::uint32_t last_ns = 0;  // of all shots: those without an echo say how far the message reaches
  for (const auto& point : message.points()) {
    last_ns = std::max(last_ns, point.offset_time());
    const float x = point.x(), y = point.y(), z = point.z();
    if (!lidar::keep_livox_return(x, y, z, point.tag(), options.noise)) continue;
    chunk.returns.push_back(
        {x, y, z, static_cast<float>(point.reflectivity()), point.offset_time(), point.line()});
  }
  chunk.end_ns = chunk.stamp_ns + last_ns;
  return last_ns > options.clock_jump_ns ? "has a point more than a second after the first" : "";
}

}  // namespace camvox::sync_component
