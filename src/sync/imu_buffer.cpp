#include "camvox/sync/imu_buffer.hpp"

#include <algorithm>

namespace camvox::sync {

bool ImuBuffer::add(const ImuSample& sample) {
  const auto verdict = guard_.judge(sample.stamp_ns);
  counters_.count(verdict);
  if (!is_usable(verdict)) return false;
  if (verdict == StampVerdict::kJump) samples_.clear();
  ++counters_.used;
  samples_.push_back(sample);
  if (samples_.size() > max_samples_) samples_.pop_front();
  return true;
}

void ImuBuffer::forget_before(std::int64_t stamp_ns) {
  // One older sample stays, so that the oldest interval still needed has both its ends.
  while (samples_.size() > 1 && samples_[1].stamp_ns < stamp_ns) samples_.pop_front();
}

std::optional<std::int64_t> ImuBuffer::newest_ns() const {
  if (samples_.empty()) return std::nullopt;
  return samples_.back().stamp_ns;
}

std::vector<ImuSample> ImuBuffer::between(std::int64_t begin_ns,
                                          std::int64_t end_ns,
                                          std::size_t max_count) const {
  auto first = std::ranges::upper_bound(samples_, begin_ns, {}, &ImuSample::stamp_ns);
  auto last = std::ranges::lower_bound(samples_, end_ns, {}, &ImuSample::stamp_ns);
  if (first != samples_.begin()) --first;
  if (last != samples_.end()) ++last;
  if (first >= last) return {};
  const auto count = static_cast<std::size_t>(last - first);
  if (count > max_count) first += static_cast<std::ptrdiff_t>(count - max_count);
  return {first, last};
}

}  // namespace camvox::sync
