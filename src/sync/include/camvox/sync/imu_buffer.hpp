#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "camvox/sync/counters.hpp"
#include "camvox/sync/stamp_guard.hpp"

namespace camvox::sync {

/// One IMU measurement in the IMU frame.
struct ImuSample {
  std::int64_t stamp_ns = 0;
  double gyro_rad_s[3] = {};
  double force_m_s2[3] = {};  ///< Specific force: +g upwards at rest.
};

/// Keeps the latest IMU samples. One that comes out of order is left out: interpolating over it
/// costs less than waiting for it, and the result does not depend on when it came.
class ImuBuffer {
 public:
  ImuBuffer(std::int64_t clock_jump_ns, std::size_t max_samples)
      : guard_(clock_jump_ns), max_samples_(max_samples) {}

  bool add(const ImuSample& sample);
  void forget_before(std::int64_t stamp_ns);

  [[nodiscard]] std::optional<std::int64_t> newest_ns() const;
  /// The samples in [begin, end] and one more on either side, at most `max_count`: the latest.
  [[nodiscard]] std::vector<ImuSample> between(std::int64_t begin_ns,
                                               std::int64_t end_ns,
                                               std::size_t max_count) const;
  [[nodiscard]] std::size_t size() const { return samples_.size(); }
  [[nodiscard]] StreamCounters& counters() { return counters_; }
  [[nodiscard]] const StreamCounters& counters() const { return counters_; }

 private:
  StampGuard guard_;
  std::size_t max_samples_;
  std::deque<ImuSample> samples_;  // by stamp
  StreamCounters counters_;
};

}  // namespace camvox::sync
