#pragma once

#include <cstdint>
#include <string>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/lidar/livox.hpp"
#include "camvox/sync/lidar_buffer.hpp"

namespace camvox::sync_component {

/// How lidar messages are read.
struct LidarInputOptions {
  lidar::NoiseConfidence noise = lidar::NoiseConfidence::kModerate;
  std::string point_time_unit = "auto";        ///< Of a cloud's time field: auto, s, ms, us, ns.
  std::int64_t clock_jump_ns = 1'000'000'000;  ///< See timebase, below.
};

/// Reads a message of a Livox driver. Times count from `timebase`, the lidar's own clock; if that
/// is not the clock of the header (the lidar is not synchronised), from the header's stamp, which
/// the camera's driver shares. `chunk.returns` is overwritten. Returns what is wrong, or "".
[[nodiscard]] std::string read_livox(const livox_ros_driver2::msg::CustomMsg& message,
                                     const LidarInputOptions& options,
                                     sync::LidarChunk& chunk);

/// Reads a cloud with fields x y z (float32 or float64), and if present: reflectivity or intensity
/// (clipped to 0..255), line or ring, and a time per point,
/// under any of the names that drivers use (offset_time, t, time, timestamp, time_stamp,
/// time_offset, stamp). Its unit is the usual one of its type: integers ns, float32 s, float64 s
/// or ns since the epoch or the stamp, whichever its size says. Negative times, of stamps at the
/// end of a sweep, are allowed. Without a time field the chunk says so. Returns what is wrong, or
/// "".
[[nodiscard]] std::string read_point_cloud(const sensor_msgs::msg::PointCloud2& message,
                                           const LidarInputOptions& options,
                                           sync::LidarChunk& chunk);

}  // namespace camvox::sync_component
