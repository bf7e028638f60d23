#include "camvox/sync_component/sync_component_config.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::sync_component {
namespace {

lidar::NoiseConfidence noise_of(const std::string& name) {
  if (name == "off") return lidar::NoiseConfidence::kKeepAll;
  if (name == "high") return lidar::NoiseConfidence::kHigh;
  return name == "low" ? lidar::NoiseConfidence::kLow : lidar::NoiseConfidence::kModerate;
}

}  // namespace

SyncComponentConfig checked(SyncComponentConfig config) {
  auto problems = sensors::check(config.camera);
  std::ranges::move(sensors::check(config.rig), std::back_inserter(problems));
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return config;
}

sync::AssemblerOptions assembler_options(const SyncComponentConfig& config) {
  sync::AssemblerOptions options;
  options.use_lidar = config.depth_source != "depth_image";
  options.lockstep = config.lockstep;
  options.camera_time_offset_ns =
      config.rig.camera_time_offset_ns +
      std::llround(1e9 * config.row_time_s * 0.5 * (config.camera.height_px - 1));
  options.imu_time_offset_ns = config.rig.imu_time_offset_ns;
  options.max_imu_samples = camvox_interfaces::msg::SCAN_IMU_SAMPLES;
  return options;
}

LidarInputOptions lidar_input_options(const SyncComponentConfig& config) {
  return {
      noise_of(config.noise_filter), config.point_time_unit, sync::to_ns(config.sync.clock_jump_s)};
}

}  // namespace camvox::sync_component
