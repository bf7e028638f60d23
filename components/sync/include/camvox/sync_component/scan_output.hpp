#pragma once

#include <optional>

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/lidar/force_unit.hpp"
#include "camvox/sync/frame_assembler.hpp"

namespace camvox::sync_component {

/// A sample in SI units; `unit` learns from it whether the driver reports g. Nothing if a number is
/// not finite.
[[nodiscard]] std::optional<sync::ImuSample> read_imu(const sensor_msgs::msg::Imu& imu,
                                                      lidar::ForceUnit& unit);

/// Cuts a frame's returns into a scan, with its IMU samples; all but frame id and `stationary`.
/// False if there are more returns than a scan can carry: then it has none.
[[nodiscard]] bool write_scan(const sync::Frame& frame,
                              const sync::LidarBuffer& lidar,
                              camvox_interfaces::msg::Scan& scan);

}  // namespace camvox::sync_component
