#include "camvox/sync/frame_assembler.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::sync {
namespace {

constexpr std::size_t kMaxBufferedSamples = 1U << 14;  // 16 s at 1 kHz
constexpr std::int64_t kLockstepGap_ns = 5'000'000;    // waiting costs nothing; a lost packet does
constexpr double kLockstepStall_s = 10.0;              // nothing moves any more

std::int64_t window_begin(const SyncConfig& config) {
  if (config.scan_window == "after") return 0;
  if (config.scan_window == "before") return -to_ns(config.window_s);
  return -to_ns(config.window_s) / 2;
}

const SyncConfig& checked(const SyncConfig& config) {
  config::require_valid(config, "sync");
  return config;
}

}  // namespace

std::int64_t to_ns(double time_s) { return std::llround(time_s * 1e9); }

FrameAssembler::FrameAssembler(const SyncConfig& config, const AssemblerOptions& options)
    : config_(checked(config)),
      options_(options),
      window_ns_(to_ns(config.window_s)),
      window_begin_ns_(window_begin(config)),
      guard_(to_ns(config.clock_jump_s)),
      lidar_(to_ns(config.clock_jump_s), options.max_buffered_returns),
      imu_(to_ns(config.clock_jump_s), kMaxBufferedSamples) {
  lidar_alive_.alive = options.use_lidar;
  depth_alive_.alive = !options.use_lidar;
  imu_alive_.alive = options.use_lidar && config.use_imu;
}

ImageVerdict FrameAssembler::judge_image(std::int64_t driver_stamp_ns) {
  const std::int64_t stamp_ns = lidar_time_ns(driver_stamp_ns);
  ++image_counters_.received;
  const auto verdict = guard_.judge(stamp_ns);
  image_counters_.count(verdict);
  switch (verdict) {
    case StampVerdict::kDuplicate:
      return ImageVerdict::kDuplicate;
    case StampVerdict::kEarlier:
      ++frame_counters_.left_out;
      return ImageVerdict::kOutOfOrder;
    case StampVerdict::kSuspect:
      ++frame_counters_.left_out;
      return ImageVerdict::kSuspect;
    case StampVerdict::kJump:
      last_image_ns_.reset();
      break;
    case StampVerdict::kNext:
      break;
  }
  return ImageVerdict::kAccepted;
}

void FrameAssembler::add_image(std::int64_t driver_stamp_ns, std::int64_t now_ns) {
  const std::int64_t stamp_ns = lidar_time_ns(driver_stamp_ns);
  ++image_counters_.used;
  pending_.push_back({stamp_ns, last_image_ns_.value_or(stamp_ns), now_ns});
  last_image_ns_ = stamp_ns;
}

bool FrameAssembler::add_lidar(LidarChunk&& chunk, std::int64_t now_ns) {
  ++lidar_.counters().received;
  lidar_alive_ = {options_.use_lidar, now_ns};
  return lidar_.add(std::move(chunk));
}

bool FrameAssembler::add_imu(ImuSample sample, std::int64_t now_ns) {
  ++imu_.counters().received;
  imu_alive_ = {options_.use_lidar && config_.use_imu, now_ns};
  sample.stamp_ns += options_.imu_time_offset_ns;
  return imu_.add(sample);
}

void FrameAssembler::set_newest_depth(std::int64_t driver_stamp_ns, std::int64_t now_ns) {
  depth_alive_ = {!options_.use_lidar, now_ns};
  newest_depth_ns_ = lidar_time_ns(driver_stamp_ns);
}

LidarWindow FrameAssembler::window_of(std::int64_t stamp_ns) const {
  const std::int64_t begin_ns = stamp_ns + window_begin_ns_;
  const std::int64_t gap_ns = to_ns(config_.max_lidar_gap_s);
  return {begin_ns,
          begin_ns + window_ns_,
          stamp_ns,
          to_ns(config_.boundary_tolerance_s),
          options_.lockstep ? std::min(gap_ns, kLockstepGap_ns) : gap_ns,
          to_ns(config_.max_wait_s)};
}

bool FrameAssembler::imu_reaches(const LidarWindow& window) const {
  const auto newest_ns = imu_.newest_ns();
  return newest_ns && *newest_ns >= std::max(window.end_ns, window.image_ns);
}

bool FrameAssembler::waited_enough(const Pending& frame, std::int64_t now_ns) const {
  if (pending_.size() > static_cast<std::size_t>(config_.max_pending_frames)) return true;
  const std::int64_t rest_ns = std::max<std::int64_t>(0, window_begin_ns_ + window_ns_);
  const double patience_s = options_.lockstep ? kLockstepStall_s : config_.max_wait_s;
  // In lockstep the clock starts anew with whatever arrives: only silence counts.
  std::int64_t since_ns = frame.arrival_ns;
  if (options_.lockstep) {
    since_ns = std::max({pending_.back().arrival_ns,
                         lidar_alive_.last_arrival_ns.value_or(since_ns),
                         imu_alive_.last_arrival_ns.value_or(since_ns),
                         depth_alive_.last_arrival_ns.value_or(since_ns)});
  }
  return now_ns - since_ns >= rest_ns + to_ns(patience_s);
}

void FrameAssembler::give_up(Liveness& sensor, std::int64_t now_ns) const {
  const bool silent =
      !sensor.last_arrival_ns || now_ns - *sensor.last_arrival_ns > to_ns(config_.stream_timeout_s);
  if (silent) sensor.alive = false;
}

std::optional<Frame> FrameAssembler::take_ready(std::int64_t now_ns) {
  if (pending_.empty()) return std::nullopt;
  const auto& next = pending_.front();
  Frame frame{next.stamp_ns, window_of(next.stamp_ns), {}, false, false};
  frame.has_lidar = options_.use_lidar && lidar_.is_settled(frame.window);
  frame.has_imu = options_.use_lidar && config_.use_imu && imu_reaches(frame.window);
  const bool has_depth = newest_depth_ns_ >= next.stamp_ns;
  const bool missing = (lidar_alive_.alive && !frame.has_lidar) ||
                       (imu_alive_.alive && !frame.has_imu) || (depth_alive_.alive && !has_depth);
  if (missing) {
    if (!waited_enough(next, now_ns)) return std::nullopt;
    if (!frame.has_lidar) give_up(lidar_alive_, now_ns);
    if (!frame.has_imu) give_up(imu_alive_, now_ns);
    if (!has_depth) give_up(depth_alive_, now_ns);
  }
  const std::int64_t first_ns = std::min(frame.window.begin_ns, next.previous_ns);
  const std::int64_t last_ns = std::max(frame.window.end_ns, next.stamp_ns);
  frame.imu = imu_.between(first_ns, last_ns, options_.max_imu_samples);
  frame_counters_.complete +=
      frame.has_lidar == options_.use_lidar && (frame.has_imu || !config_.use_imu) ? 1 : 0;
  frame_counters_.without_lidar += options_.use_lidar && !frame.has_lidar ? 1 : 0;
  frame_counters_.without_imu += options_.use_lidar && config_.use_imu && !frame.has_imu ? 1 : 0;
  pending_.pop_front();
  forget();
  return frame;
}

/// Nothing in front of this frame's window, or of the image before the next frame, is needed again.
void FrameAssembler::forget() {
  if (!last_image_ns_) return;
  const std::int64_t oldest_ns = pending_.empty() ? *last_image_ns_ : pending_.front().stamp_ns;
  const std::int64_t keep_ns = to_ns(config_.buffer_s);
  lidar_.forget_before(oldest_ns - keep_ns);
  imu_.forget_before(oldest_ns - keep_ns);
}

}  // namespace camvox::sync
