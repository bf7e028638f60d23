#include "camvox/sync/stamp_guard.hpp"

namespace camvox::sync {

StampVerdict StampGuard::judge(std::int64_t stamp_ns) {
  if (!newest_ns_) {
    newest_ns_ = stamp_ns;
    return StampVerdict::kNext;
  }
  const std::int64_t step_ns = stamp_ns - *newest_ns_;
  if (step_ns == 0) return StampVerdict::kDuplicate;
  if (step_ns > 0 && step_ns <= clock_jump_ns_) {
    newest_ns_ = stamp_ns;
    suspect_ns_.reset();
    return StampVerdict::kNext;
  }
  if (step_ns < 0 && step_ns >= -clock_jump_ns_) return StampVerdict::kEarlier;
  if (suspect_ns_ && stamp_ns > *suspect_ns_ && stamp_ns - *suspect_ns_ <= clock_jump_ns_) {
    newest_ns_ = stamp_ns;
    suspect_ns_.reset();
    return StampVerdict::kJump;
  }
  suspect_ns_ = stamp_ns;
  return StampVerdict::kSuspect;
}

}  // namespace camvox::sync
