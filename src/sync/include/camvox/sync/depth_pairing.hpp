#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "camvox/sync/counters.hpp"
#include "camvox/sync/stamp_guard.hpp"

namespace camvox::sync {

/// Finds the depth image of an RGB-D camera that belongs to a colour image: the nearest in time, if
/// it is near enough. Each is used once.
template <typename Payload>
class DepthPairing {
 public:
  DepthPairing(std::int64_t max_difference_ns, std::int64_t clock_jump_ns, std::size_t capacity)
      : max_difference_ns_(max_difference_ns), guard_(clock_jump_ns), capacity_(capacity) {}

  /// Whether a message with this stamp is worth reading; if so, `add` must follow.
  [[nodiscard]] bool accepts(std::int64_t stamp_ns) {
    ++counters_.received;
    const auto verdict = guard_.judge(stamp_ns);
    counters_.count(verdict);
    if (!is_usable(verdict)) return false;
    if (verdict == StampVerdict::kJump) waiting_.clear();
    if (waiting_.size() >= capacity_) waiting_.pop_front();
    return true;
  }

  void add(std::int64_t stamp_ns, Payload payload) {
    ++counters_.used;
    waiting_.push_back({stamp_ns, std::move(payload)});
  }

  /// Whether no depth image that comes later can be nearer to `image_ns` than those known.
  [[nodiscard]] bool decided(std::int64_t image_ns) const {
    return guard_.newest_ns() && *guard_.newest_ns() >= image_ns;
  }

  /// Takes out the partner of an image, and forgets all older ones. Call in order of the images.
  [[nodiscard]] std::optional<Payload> take(std::int64_t image_ns) {
    while (waiting_.size() > 1 &&
           distance(waiting_[1], image_ns) <= distance(waiting_[0], image_ns)) {
      waiting_.pop_front();
    }
    if (waiting_.empty() || distance(waiting_.front(), image_ns) > max_difference_ns_) {
      return std::nullopt;
    }
    auto payload = std::move(waiting_.front().payload);
    waiting_.pop_front();
    return payload;
  }

  [[nodiscard]] StreamCounters& counters() { return counters_; }

 private:
  struct Waiting {
    std::int64_t stamp_ns;
    Payload payload;
  };
  [[nodiscard]] static std::int64_t distance(const Waiting& depth, std::int64_t image_ns) {
    return depth.stamp_ns < image_ns ? image_ns - depth.stamp_ns : depth.stamp_ns - image_ns;
  }

  std::int64_t max_difference_ns_;
  StampGuard guard_;
  std::size_t capacity_;
  std::deque<Waiting> waiting_;
  StreamCounters counters_;
};

}  // namespace camvox::sync
