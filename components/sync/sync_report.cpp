#include "camvox/sync_component/sync_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <utility>

namespace camvox::sync_component {
namespace {

void write_estimate(Diagnostics& diagnostics,
                    const std::string& name,
                    const sync::OffsetEstimator& estimator) {
  const auto estimate = estimator.estimate();
  if (estimate.count == 0) return;
  diagnostics.set(name + "_s", estimate.offset_s);
  diagnostics.set(name + "_jitter_s", estimate.jitter_s);
}

/// By how much the sensor's latest stamp differs from the camera's; 0 if one of them is silent.
double clock_difference_s(const std::optional<std::int64_t>& sensor_ns,
                          const std::optional<std::int64_t>& camera_ns) {
  return sensor_ns && camera_ns ? 1e-9 * static_cast<double>(*sensor_ns - *camera_ns) : 0.0;
}

}  // namespace

void SyncReport::write_stream(Diagnostics& diagnostics,
                              const std::string& name,
                              const sync::StreamCounters& counters) {
  diagnostics.set(name + ".received", counters.received);
  diagnostics.set(name + ".used", counters.used);
  diagnostics.set(name + ".duplicates", counters.duplicates);
  diagnostics.set(name + ".reordered", counters.reordered);
  diagnostics.set(name + ".late", counters.late);
  diagnostics.set(name + ".suspects", counters.suspects);
  diagnostics.set(name + ".clock_jumps", counters.clock_jumps);
  diagnostics.set(name + ".malformed", counters.malformed);
}

SyncReport::Health SyncReport::judge(sync::FrameAssembler& assembler, bool force_implausible) {
  const auto& frames = assembler.frame_counters();
  const auto incomplete = frames.without_lidar + frames.without_imu + frames.left_out;
  const bool new_incomplete = std::exchange(incomplete_, incomplete) != incomplete;
  if (!camera_problem_.empty()) return {HealthLevel::kError, camera_problem_};
  if (!input_problem_.empty()) return {HealthLevel::kError, std::exchange(input_problem_, {})};
  const bool uses_lidar = assembler.options().use_lidar;
  const bool uses_imu = uses_lidar && assembler.config().use_imu;
  const auto camera_ns = assembler.newest_image_ns();
  const double limit_s = assembler.config().clock_jump_s;
  const auto differs = [&](const char* name, const std::optional<std::int64_t>& sensor_ns) {
    const double difference_s = clock_difference_s(sensor_ns, camera_ns);
    if (std::abs(difference_s) < limit_s) return std::string();
    return fmt::format("{} stamps are {:+.3f} s from the camera's", name, difference_s);
  };
  if (uses_lidar && assembler.lidar_alive()) {
    auto text = differs("lidar", assembler.lidar().newest_ns());
    if (!text.empty()) return {HealthLevel::kError, std::move(text)};
  }
  if (uses_imu && assembler.imu_alive()) {
    auto text = differs("IMU", assembler.imu().newest_ns());
    if (!text.empty()) return {HealthLevel::kError, std::move(text)};
  }
  if (!camera_ns) return {HealthLevel::kWarn, "no image yet"};
  if (uses_lidar && !assembler.lidar_alive()) return {HealthLevel::kWarn, "the lidar is silent"};
  if (uses_imu && !assembler.imu_alive()) return {HealthLevel::kWarn, "the IMU is silent"};
  if (force_implausible) return {HealthLevel::kWarn, "the accelerometer shows neither m/s^2 nor g"};
  if (new_incomplete)
    return {HealthLevel::kWarn, "frames incomplete or left out; see the counters"};
  return {};
}

void SyncReport::write(Diagnostics& diagnostics,
                       sync::FrameAssembler& assembler,
                       bool force_implausible) {
  write_stream(diagnostics, "image", assembler.image_counters());
  write_estimate(diagnostics, "image_delay", image_delay_);
  if (assembler.options().use_lidar) {
    write_stream(diagnostics, "lidar", assembler.lidar().counters());
    write_stream(diagnostics, "imu", assembler.imu().counters());
    write_estimate(diagnostics, "lidar_delay", lidar_delay_);
    write_estimate(diagnostics, "imu_delay", imu_delay_);
    write_estimate(diagnostics, "image_to_scan_offset", image_to_scan_);
  }
  const auto& frames = assembler.frame_counters();
  diagnostics.set("frames.complete", frames.complete);
  diagnostics.set("frames.without_lidar", frames.without_lidar);
  diagnostics.set("frames.without_imu", frames.without_imu);
  diagnostics.set("frames.left_out", frames.left_out);
  diagnostics.set("frames.over_capacity", frames.over_capacity);
  diagnostics.set("frames.pending", static_cast<std::uint64_t>(assembler.pending()));
  const auto health = judge(assembler, force_implausible);
  diagnostics.report(health.level, health.message);
}

std::string shortfall(sync::FrameAssembler& assembler) {
  const auto& frames = assembler.frame_counters();
  std::string text;
  const auto add = [&text](std::uint64_t count, const char* what) {
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, what);
  };
  add(frames.left_out, "made no frame");
  add(assembler.pending(), "still waited at the end");
  add(frames.without_lidar, "had not all of their lidar returns");
  add(frames.without_imu, "had not all of their IMU samples");
  if (text.empty()) return text;
  const auto& images = assembler.image_counters();
  return fmt::format("images: {} came, of which {}", images.received - images.duplicates, text);
}

}  // namespace camvox::sync_component
