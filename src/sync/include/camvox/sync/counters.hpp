#pragma once

#include <cstdint>

#include "camvox/sync/stamp_guard.hpp"

namespace camvox::sync {

/// What became of the messages of one sensor.
struct StreamCounters {
  std::uint64_t received = 0;
  std::uint64_t used = 0;        ///< Entered the buffer.
  std::uint64_t duplicates = 0;  ///< Same stamp again; left out.
  std::uint64_t reordered = 0;   ///< Came after a newer one, and were put where they belong.
  std::uint64_t late = 0;        ///< Came after a newer one, too late to be used.
  std::uint64_t suspects = 0;    ///< Stamp far from all others; left out.
  std::uint64_t clock_jumps = 0;
  std::uint64_t malformed = 0;  ///< Could not be read; see the log.

  /// Counts what the guard says of a message's stamp; what may be used is counted by its user.
  void count(StampVerdict verdict) {
    switch (verdict) {
      case StampVerdict::kDuplicate:
        ++duplicates;
        break;
      case StampVerdict::kEarlier:
        ++late;
        break;
      case StampVerdict::kSuspect:
        ++suspects;
        break;
      case StampVerdict::kJump:
        ++clock_jumps;
        break;
      case StampVerdict::kNext:
        break;
    }
  }
};

/// What became of the triggers.
struct FrameCounters {
  std::uint64_t complete = 0;       ///< With all that belongs to them.
  std::uint64_t without_lidar = 0;  ///< No returns, or not up to the end of the window.
  std::uint64_t without_imu = 0;    ///< IMU samples do not span the frame.
  std::uint64_t left_out = 0;       ///< Images that made no frame.
  std::uint64_t over_capacity = 0;  ///< More returns than a scan can carry; sent without.
};

}  // namespace camvox::sync
