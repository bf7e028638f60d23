#include "camvox/sync/lidar_buffer.hpp"

#include <algorithm>
#include <limits>

namespace camvox::sync {
namespace {

constexpr std::size_t kMaxSpare = 8;
constexpr std::int64_t kSteady_ns = 1'000'000;  // periods that differ by less are the same
constexpr std::int64_t kLongestPeriod_ns = 200'000'000;

std::size_t count_inside(const LidarChunk& chunk, std::int64_t begin_ns, std::int64_t end_ns) {
  return static_cast<std::size_t>(std::ranges::count_if(chunk.returns, [&](const auto& point) {
    const std::int64_t time_ns = chunk.stamp_ns + point.offset_ns;
    return time_ns >= begin_ns && time_ns < end_ns;
  }));
}

bool is_too_late(const LidarChunk& chunk, const LidarWindow& window) {
  return chunk.newest_before_ns >= window.end_ns + window.max_wait_ns;
}

/// Appends the returns of one chunk that lie in the window; offsets count from `origin_ns`.
std::size_t append(const LidarChunk& chunk,
                   std::int64_t begin_ns,
                   std::int64_t end_ns,
                   std::int64_t origin_ns,
                   const ScanLists& lists,
                   std::size_t count) {
  // Offsets of the window's ends in the chunk: one unsigned comparison a return.
  const std::int64_t first_ns = std::max<std::int64_t>(0, begin_ns - chunk.stamp_ns);
  const std::int64_t length_ns = end_ns - chunk.stamp_ns - first_ns;
  if (length_ns <= 0 || first_ns > std::numeric_limits<std::uint32_t>::max()) return count;
  const auto first = static_cast<std::uint32_t>(first_ns);
  const auto length = static_cast<std::uint32_t>(
      std::min<std::int64_t>(length_ns, std::numeric_limits<std::uint32_t>::max()));
  const auto shift = static_cast<std::uint32_t>(chunk.stamp_ns - origin_ns);
  for (const auto& point : chunk.returns) {
    if (point.offset_ns - first >= length) continue;
    auto& row = lists.points[count];
    row[0] = point.x_m;
    row[1] = point.y_m;
    row[2] = point.z_m;
    row[3] = point.reflectivity;
    lists.offset_ns[count] = point.offset_ns + shift;  // wraps for chunks before the origin
    lists.line[count] = point.line;
    ++count;
  }
  return count;
}

}  // namespace

bool LidarBuffer::add(LidarChunk&& chunk) {
  const auto verdict = guard_.judge(chunk.stamp_ns);
  if (verdict == StampVerdict::kSuspect) {
    ++counters_.suspects;
    return false;
  }
  if (verdict == StampVerdict::kJump) {
    ++counters_.clock_jumps;
    clear();
  }
  const auto place = std::ranges::lower_bound(chunks_, chunk.stamp_ns, {}, &LidarChunk::stamp_ns);
  const bool known = place != chunks_.end() && place->stamp_ns == chunk.stamp_ns;
  if (known || verdict == StampVerdict::kDuplicate) {
    ++counters_.duplicates;
    return false;
  }
  if (chunk.end_ns < forgotten_ns_) {
    ++counters_.late;
    return false;
  }
  if (verdict != StampVerdict::kEarlier) extend_to_period(chunk);
  if (verdict == StampVerdict::kEarlier) {
    ++counters_.reordered;
    chunk.newest_before_ns = newest_ns_.value_or(chunk.end_ns);
  }
  ++counters_.used;
  newest_ns_ = std::max(newest_ns_.value_or(chunk.end_ns), chunk.end_ns);
  total_returns_ += chunk.returns.size();
  chunks_.insert(place, std::move(chunk));
  while (total_returns_ > max_returns_ && chunks_.size() > 1) forget_oldest();
  return true;
}

/// The last returns of a message may be missing because the beam met the sky. A driver that sends
/// steadily says with the next message's stamp how far each one reaches.
void LidarBuffer::extend_to_period(LidarChunk& chunk) {
  const std::int64_t period_ns = last_stamp_ns_ ? chunk.stamp_ns - *last_stamp_ns_ : 0;
  const bool steady = std::abs(period_ns - period_ns_) < kSteady_ns;
  if (chunk.has_point_times && steady && period_ns < kLongestPeriod_ns) {
    chunk.end_ns = std::max(chunk.end_ns, chunk.stamp_ns + std::min(period_ns, period_ns_) - 1);
  }
  last_stamp_ns_ = chunk.stamp_ns;
  period_ns_ = period_ns;
}

void LidarBuffer::clear() {
  while (!chunks_.empty()) forget_oldest();
  newest_ns_.reset();
  last_stamp_ns_.reset();
  forgotten_ns_ = std::numeric_limits<std::int64_t>::min();
}

void LidarBuffer::forget_oldest() {
  auto& oldest = chunks_.front();
  total_returns_ -= oldest.returns.size();
  forgotten_ns_ = std::max(forgotten_ns_, oldest.end_ns);
  if (spare_.size() < kMaxSpare) {
    oldest.returns.clear();
    spare_.push_back(std::move(oldest.returns));
  }
  chunks_.pop_front();
}

std::vector<LidarReturn> LidarBuffer::take_spare() {
  if (spare_.empty()) return {};
  auto list = std::move(spare_.back());
  spare_.pop_back();
  return list;
}

void LidarBuffer::forget_before(std::int64_t stamp_ns) {
  while (!chunks_.empty() && chunks_.front().end_ns < stamp_ns) forget_oldest();
}

std::int64_t LidarBuffer::snapped(std::int64_t time_ns, std::int64_t tolerance_ns) const {
  const auto next =
      std::ranges::lower_bound(chunks_, time_ns - tolerance_ns, {}, &LidarChunk::stamp_ns);
  const bool near = next != chunks_.end() && next->stamp_ns < time_ns;
  return near ? next->stamp_ns : time_ns;
}

bool LidarBuffer::is_settled(const LidarWindow& window) const {
  return covers(window) || (newest_ns_ && *newest_ns_ >= window.end_ns + window.max_wait_ns);
}

bool LidarBuffer::covers(const LidarWindow& window) const {
  const std::int64_t begin_ns = snapped(window.begin_ns, window.tolerance_ns);
  const std::int64_t end_ns = snapped(window.end_ns, window.tolerance_ns) - window.tolerance_ns;
  std::int64_t covered_ns = begin_ns;
  for (const auto& chunk : chunks_) {
    if (is_too_late(chunk, window)) continue;
    if (chunk.stamp_ns - covered_ns > window.max_gap_ns && chunk.has_point_times) return false;
    covered_ns = std::max(covered_ns, chunk.end_ns);
    if (covered_ns >= end_ns) return true;
  }
  return false;
}

const LidarChunk* LidarBuffer::nearest_untimed(const LidarWindow& window) const {
  const LidarChunk* nearest = nullptr;
  std::int64_t best_ns = window.end_ns - window.begin_ns;
  for (const auto& chunk : chunks_) {
    const std::int64_t distance_ns = std::abs(chunk.stamp_ns - window.image_ns);
    if (chunk.has_point_times || distance_ns >= best_ns || is_too_late(chunk, window)) continue;
    best_ns = distance_ns;
    nearest = &chunk;
  }
  return nearest;
}

std::optional<std::int64_t> LidarBuffer::nearest_stamp_ns(std::int64_t time_ns) const {
  std::optional<std::int64_t> nearest;
  for (const auto& chunk : chunks_) {
    if (!nearest || std::abs(chunk.stamp_ns - time_ns) < std::abs(*nearest - time_ns)) {
      nearest = chunk.stamp_ns;
    }
  }
  return nearest;
}

ScanCut LidarBuffer::cut(const LidarWindow& window, const ScanLists& lists) const {
  if (const auto* whole = nearest_untimed(window); whole != nullptr) {
    const std::int64_t stamp_ns = whole->stamp_ns;
    if (whole->returns.size() > lists.points.size()) return {stamp_ns, 0, true};
    return {stamp_ns, append(*whole, stamp_ns, stamp_ns + 1, stamp_ns, lists, 0), false};
  }
  const std::int64_t begin_ns = snapped(window.begin_ns, window.tolerance_ns);
  const std::int64_t end_ns = snapped(window.end_ns, window.tolerance_ns);
  std::size_t count = 0;
  for (const auto& chunk : chunks_) {
    if (!chunk.has_point_times || chunk.end_ns < begin_ns || chunk.stamp_ns >= end_ns) continue;
    if (is_too_late(chunk, window)) continue;
    const std::size_t room = lists.points.size() - count;
    if (chunk.returns.size() > room && count_inside(chunk, begin_ns, end_ns) > room) {
      return {begin_ns, 0, true};
    }
    count = append(chunk, begin_ns, end_ns, begin_ns, lists, count);
  }
  const auto offsets = lists.offset_ns.first(count);
  if (offsets.empty()) return {begin_ns, 0, false};
  const std::uint32_t first_ns = *std::ranges::min_element(offsets);
  for (auto& offset_ns : offsets) offset_ns -= first_ns;
  return {begin_ns + first_ns, count, false};
}

}  // namespace camvox::sync
