#pragma once

#include <cstdint>
#include <optional>

namespace camvox::sync {

/// What a message's stamp says, given those of the same sensor before it.
enum class StampVerdict : std::uint8_t {
  kNext,       ///< Later than all before.
  kDuplicate,  ///< The newest stamp once more.
  kEarlier,    ///< Out of order: older than the newest, by less than a clock jump.
  kSuspect,  ///< Far from all before: a glitch, or the first one of another clock. Not to be used.
  kJump,     ///< The second one of another clock: what came before is of no use any more.
};

/// Whether a sensor whose messages must come in order can use this one.
[[nodiscard]] constexpr bool is_usable(StampVerdict verdict) {
  return verdict == StampVerdict::kNext || verdict == StampVerdict::kJump;
}

/// Watches the stamps of one sensor. One stamp that is far off is a glitch; two in a row are a
/// clock that was set, a driver that was started again, or a sensor that comes back after a pause.
class StampGuard {
 public:
  explicit StampGuard(std::int64_t clock_jump_ns) : clock_jump_ns_(clock_jump_ns) {}

  [[nodiscard]] StampVerdict judge(std::int64_t stamp_ns);

  /// The newest stamp of the present clock.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const { return newest_ns_; }

 private:
  std::int64_t clock_jump_ns_;
  std::optional<std::int64_t> newest_ns_;
  std::optional<std::int64_t> suspect_ns_;
};

}  // namespace camvox::sync
