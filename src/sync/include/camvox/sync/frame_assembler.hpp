#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "camvox/sync/imu_buffer.hpp"
#include "camvox/sync/lidar_buffer.hpp"
#include "camvox/sync/sync_config.hpp"

namespace camvox::sync {

/// How the assembler works, beside its SyncConfig.
struct AssemblerOptions {
  bool use_lidar = true;                   ///< Lidar and IMU; false: an RGB-D camera's depth.
  bool lockstep = false;                   ///< Wait as long as it takes: see FrameAssembler.
  std::int64_t camera_time_offset_ns = 0;  ///< Add to a camera stamp to get lidar time.
  std::int64_t imu_time_offset_ns = 0;     ///< Add to an IMU stamp to get lidar time.
  std::size_t max_imu_samples = 1024;      ///< Of one frame.
  std::size_t max_buffered_returns = 1U << 20;
};

/// What became of an image.
enum class ImageVerdict : std::uint8_t {
  kAccepted,
  kDuplicate,
  kOutOfOrder,  ///< A newer one came before.
  kSuspect,     ///< Its stamp is far from all others: see StampGuard.
};

/// One trigger with what belongs to it; all stamps in lidar time.
struct Frame {
  std::int64_t stamp_ns = 0;   ///< Of the image.
  LidarWindow window;          ///< For LidarBuffer::cut.
  std::vector<ImuSample> imu;  ///< Spans window, image and previous image, one more either side.
  bool has_lidar = false;      ///< Returns reach to the end of the window.
  bool has_imu = false;        ///< Samples reach to the end of image and window.
};

/// Pairs each image with the lidar returns and IMU samples around it.
///
/// Frames come out in the order of their images. A frame is ready when the data of every sensor
/// reach past its end; `max_wait_s` after it could have been so, it goes without what is missing. A
/// sensor that was silent for `stream_timeout_s` is not waited for until it delivers again. Nothing
/// that comes late can get into another frame, because returns and samples are chosen by their own
/// stamps.
///
/// In lockstep what a frame holds depends on the messages alone, not on when they came or in which
/// order those of different sensors did: the wait ends only when the sensor itself has gone on, or
/// after a stall that only a sensor which stopped for good can cause.
class FrameAssembler {
 public:
  /// Throws config::ConfigError.
  FrameAssembler(const SyncConfig& config, const AssemblerOptions& options);

  /// Whether an image with this stamp of the driver's is worth decoding; if so, `add_image` may
  /// follow. Others are counted.
  [[nodiscard]] ImageVerdict judge_image(std::int64_t driver_stamp_ns);
  /// Takes an accepted image; `now_ns` is when it came, on any clock that goes on.
  void add_image(std::int64_t driver_stamp_ns, std::int64_t now_ns);
  /// An accepted image could not be used.
  void leave_out() { ++frame_counters_.left_out; }
  bool add_lidar(LidarChunk&& chunk, std::int64_t now_ns);
  bool add_imu(ImuSample sample, std::int64_t now_ns);

  /// Says up to which driver's stamp depth images of an RGB-D camera have come.
  void set_newest_depth(std::int64_t driver_stamp_ns, std::int64_t now_ns);

  /// The next frame if it is ready, or has waited long enough. Its returns can be cut out of
  /// lidar() until the next call.
  [[nodiscard]] std::optional<Frame> take_ready(std::int64_t now_ns);

  [[nodiscard]] std::size_t pending() const { return pending_.size(); }
  /// A camera's stamp as lidar time.
  [[nodiscard]] std::int64_t lidar_time_ns(std::int64_t driver_stamp_ns) const {
    return driver_stamp_ns + options_.camera_time_offset_ns;
  }
  [[nodiscard]] LidarBuffer& lidar() { return lidar_; }
  [[nodiscard]] ImuBuffer& imu() { return imu_; }
  [[nodiscard]] StreamCounters& image_counters() { return image_counters_; }
  [[nodiscard]] FrameCounters& frame_counters() { return frame_counters_; }
  /// Whether a sensor is waited for: it delivers, or is not yet given up.
  [[nodiscard]] bool lidar_alive() const { return lidar_alive_.alive; }
  [[nodiscard]] bool imu_alive() const { return imu_alive_.alive; }
  [[nodiscard]] std::optional<std::int64_t> newest_image_ns() const { return guard_.newest_ns(); }
  [[nodiscard]] const AssemblerOptions& options() const { return options_; }
  [[nodiscard]] const SyncConfig& config() const { return config_; }

 private:
  struct Pending {
    std::int64_t stamp_ns;
    std::int64_t previous_ns;  ///< Image before it; its own stamp if there is none near.
    std::int64_t arrival_ns;
  };
  struct Liveness {
    bool alive = true;
    std::optional<std::int64_t> last_arrival_ns;
  };

  [[nodiscard]] LidarWindow window_of(std::int64_t stamp_ns) const;
  [[nodiscard]] bool imu_reaches(const LidarWindow& window) const;
  [[nodiscard]] bool waited_enough(const Pending& frame, std::int64_t now_ns) const;
  void give_up(Liveness& sensor, std::int64_t now_ns) const;
  void forget();

  SyncConfig config_;
  AssemblerOptions options_;
  std::int64_t window_ns_;
  std::int64_t window_begin_ns_;  // from the image
  StampGuard guard_;
  LidarBuffer lidar_;
  ImuBuffer imu_;
  Liveness lidar_alive_;
  Liveness imu_alive_;
  Liveness depth_alive_;
  std::int64_t newest_depth_ns_ = INT64_MIN;
  std::deque<Pending> pending_;
  std::optional<std::int64_t> last_image_ns_;
  StreamCounters image_counters_;
  FrameCounters frame_counters_;
};

}  // namespace camvox::sync
