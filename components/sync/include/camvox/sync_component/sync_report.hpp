#pragma once

#include <cstdint>
#include <string>

#include "camvox/component/context.hpp"
#include "camvox/sync/frame_assembler.hpp"
#include "camvox/sync/offset_estimator.hpp"

namespace camvox::sync_component {

/// What sync tells in /diagnostics: counters of every stream, how far the sensors' clocks are
/// apart, how late their messages come, and what is wrong.
///
/// `image_to_scan_offset_s` is the median of (image stamp - nearest beginning of a lidar message):
/// for a camera triggered by the lidar it is the constant offset that remains to be corrected, its
/// jitter the trigger's. Free-running sensors show a jitter of up to a quarter of their period.
class SyncReport {
 public:
  void image_came(double delay_s) { image_delay_.add(delay_s); }
  void lidar_came(double delay_s) { lidar_delay_.add(delay_s); }
  void imu_came(double delay_s) { imu_delay_.add(delay_s); }
  void frame_made(double image_to_scan_s) { image_to_scan_.add(image_to_scan_s); }
  void set_camera_problem(const std::string& problem) { camera_problem_ = problem; }
  void set_input_problem(const std::string& problem) { input_problem_ = problem; }
  [[nodiscard]] const std::string& camera_problem() const { return camera_problem_; }

  /// Writes everything, and the health that follows from it.
  void write(Diagnostics& diagnostics, sync::FrameAssembler& assembler, bool force_implausible);
  /// Writes the counters of one more stream.
  static void write_stream(Diagnostics& diagnostics,
                           const std::string& name,
                           const sync::StreamCounters& counters);

 private:
  struct Health {
    HealthLevel level = HealthLevel::kOk;
    std::string message = "ok";
  };
  [[nodiscard]] Health judge(sync::FrameAssembler& assembler, bool force_implausible);

  sync::OffsetEstimator image_delay_, lidar_delay_, imu_delay_, image_to_scan_;
  std::string camera_problem_;  ///< Stays until the driver's camera agrees.
  std::string input_problem_;   ///< The latest unreadable message since the last report.
  std::uint64_t incomplete_ = 0;
};

/// What all images that came lacked, for the end of a run; "" when each made a whole frame.
[[nodiscard]] std::string shortfall(sync::FrameAssembler& assembler);

}  // namespace camvox::sync_component
