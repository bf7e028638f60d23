#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "camvox/sync/counters.hpp"
#include "camvox/sync/stamp_guard.hpp"

namespace camvox::sync {

/// One return as it waits for its frame, in the lidar frame at its own time.
struct LidarReturn {
  float x_m;
  float y_m;
  float z_m;
  float reflectivity;  ///< 0 to 255.
  std::uint32_t offset_ns;
  std::uint8_t line;
};

/// The returns of one message of the driver, in any order.
struct LidarChunk {
  std::int64_t stamp_ns = 0;    ///< Every return is offset_ns >= 0 after it.
  std::int64_t end_ns = 0;      ///< Of the last return; stamp_ns when there is none.
  bool has_point_times = true;  ///< False: all returns carry the stamp, for want of better.
  std::vector<LidarReturn> returns;
  std::int64_t newest_before_ns = INT64_MIN;  ///< Set by the buffer if the chunk came late.
};

/// Where a cut writes: the lists of a message. All spans have the same length.
struct ScanLists {
  std::span<float[4]> points;  ///< x y z m, reflectivity.
  std::span<std::uint32_t> offset_ns;
  std::span<std::uint8_t> line;
};

/// What a cut wrote.
struct ScanCut {
  std::int64_t stamp_ns =
      0;  ///< Of the first return in time; begin of the window if there is none.
  std::size_t count = 0;
  bool over_capacity = false;  ///< The lists are too short: nothing was written.
};

/// An interval of lidar time to be cut out, begin <= time < end.
struct LidarWindow {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::int64_t image_ns = 0;      ///< For chunks without point times.
  std::int64_t tolerance_ns = 0;  ///< Either end moves back to a chunk's beginning this near.
  std::int64_t max_gap_ns = 0;    ///< Between two returns, or chunks, before data are missing.
  /// Data behind the end by this much settle what the window holds: chunks that come later are not
  /// for it any more, whether it was cut by then or not.
  std::int64_t max_wait_ns = INT64_MAX / 4;
};

/// Keeps the latest returns of a lidar so that any interval of time can be cut out of them,
/// wherever the driver's messages begin and end.
///
/// A trigger often comes within microseconds of a message's boundary. Ends of a window are then
/// moved to that boundary, so that no frame waits a whole message longer for its last few returns,
/// and what a frame holds does not depend on whether the next message is there yet.
class LidarBuffer {
 public:
  /// Keeps at most `max_returns`; the oldest messages go first.
  LidarBuffer(std::int64_t clock_jump_ns, std::size_t max_returns)
      : guard_(clock_jump_ns), max_returns_(max_returns) {}

  /// Takes a chunk, in order of time or not. False, and counted, when it is of no use.
  bool add(LidarChunk&& chunk);
  /// An empty list with the memory of a forgotten chunk.
  [[nodiscard]] std::vector<LidarReturn> take_spare();
  /// Forgets chunks that end before a time.
  void forget_before(std::int64_t stamp_ns);

  /// End of the latest data.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const { return newest_ns_; }
  /// Whether it is settled what the window holds: all is there without a gap, or comes too late.
  [[nodiscard]] bool is_settled(const LidarWindow& window) const;
  /// Whether the data of the window are all there, without a gap.
  [[nodiscard]] bool covers(const LidarWindow& window) const;
  /// Writes the returns of the window. Of chunks without point times the one nearest to the image
  /// is written whole, if it lies within the length of the window.
  [[nodiscard]] ScanCut cut(const LidarWindow& window, const ScanLists& lists) const;

  /// The beginning of a chunk nearest to a time.
  [[nodiscard]] std::optional<std::int64_t> nearest_stamp_ns(std::int64_t time_ns) const;
  [[nodiscard]] std::size_t size() const { return total_returns_; }
  [[nodiscard]] StreamCounters& counters() { return counters_; }
  [[nodiscard]] const StreamCounters& counters() const { return counters_; }

 private:
  void clear();
  void forget_oldest();
  void extend_to_period(LidarChunk& chunk);
  [[nodiscard]] std::int64_t snapped(std::int64_t time_ns, std::int64_t tolerance_ns) const;
  [[nodiscard]] const LidarChunk* nearest_untimed(const LidarWindow& window) const;

  StampGuard guard_;
  std::size_t max_returns_;
  std::deque<LidarChunk> chunks_;  // by stamp
  std::vector<std::vector<LidarReturn>> spare_;
  std::size_t total_returns_ = 0;
  std::optional<std::int64_t> newest_ns_;
  std::optional<std::int64_t> last_stamp_ns_;
  std::int64_t period_ns_ = 0;             // between the last two chunks
  std::int64_t forgotten_ns_ = INT64_MIN;  // chunks that begin before this come too late
  StreamCounters counters_;
};

}  // namespace camvox::sync
