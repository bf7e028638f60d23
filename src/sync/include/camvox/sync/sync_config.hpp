#pragma once

#include <cstdint>
#include <string>

#include "camvox/config/parameters.hpp"

namespace camvox::sync {

/// How the streams of the sensors are cut into frames. YAML keys are the field names.
struct SyncConfig {
  /// The part of the lidar stream that belongs to an image: `before` (up to the image), `after`
  /// (from the image on, the paper's choice) or `centred` around it. Measured by bench_scan_window
  /// (test/bench/preprocessing) at 30 m, 10 images/s, rms of the deskew with noisy IMU and
  /// odometry, driving with 2 m/s and 1 rad/s / handheld with 8 m/s^2:
  ///
  ///     before   2.5 / 2.0 mm    frame complete with the image
  ///     centred  1.3 / 1.0 mm    50 ms later
  ///     after    2.7 / 2.1 mm    100 ms later
  ///
  /// All are a tenth of the lidar's own noise, so the default is the one that is there first.
  /// Without an IMU the error is 10 to 40 cm, and `centred` has two thirds of it: take it then, and
  /// for spinning lidars that trigger the camera when they look forward.
  std::string scan_window = "before";
  double window_s = 0.1;          ///< Length of that part.
  double max_wait_s = 0.15;       ///< For lidar and IMU data behind the end of the window.
  double stream_timeout_s = 0.5;  ///< A sensor silent for longer is no longer waited for.
  double clock_jump_s = 1.0;      ///< Stamps that step farther are no delay but another clock.
  double max_lidar_gap_s = 0.03;  ///< A longer gap in the returns may be a message yet to come.
  double boundary_tolerance_s = 0.002;  ///< A window's end moves this far to a message's boundary.
  double max_time_difference_s = 0.02;  ///< Between an image and its depth image (RGB-D cameras).
  double buffer_s = 2.0;                ///< Lidar and IMU data older than this are forgotten.
  int max_pending_frames = 6;  ///< Images that wait for their scan; more end the oldest wait.
  bool use_imu = true;         ///< Wait for IMU samples that span the frame.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("scan_window", self.scan_window, config::one_of({"before", "after", "centred"}));
    field("window_s", self.window_s, positive, config::at_most(1.0));
    field("max_wait_s", self.max_wait_s, config::at_least(0.0), config::at_most(10.0));
    field("stream_timeout_s", self.stream_timeout_s, positive, config::at_most(60.0));
    field("clock_jump_s", self.clock_jump_s, positive, config::at_most(60.0));
    field("max_lidar_gap_s", self.max_lidar_gap_s, positive, config::at_most(10.0));
    field("boundary_tolerance_s",
          self.boundary_tolerance_s,
          config::at_least(0.0),
          config::at_most(0.02));
    field("max_time_difference_s", self.max_time_difference_s, positive, config::at_most(1.0));
    field("buffer_s", self.buffer_s, config::at_least(0.5), config::at_most(10.0));
    field("max_pending_frames", self.max_pending_frames, config::at_least(1), config::at_most(30));
    field("use_imu", self.use_imu);
  }
};

/// Nanoseconds of a config's seconds.
[[nodiscard]] std::int64_t to_ns(double time_s);

}  // namespace camvox::sync
