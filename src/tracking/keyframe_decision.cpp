#include "camvox/tracking/keyframe_decision.hpp"

#include <numbers>

namespace camvox::tracking {

bool is_keyframe(const KeyframeCues& cues, const KeyframeConfig& config) {
  const bool moved = cues.baseline_ratio >= config.min_baseline_ratio ||
                     cues.rotation_rad >= config.min_rotation_deg * std::numbers::pi / 180.0;
  if (!moved || cues.inliers <= config.min_inliers) return false;

  const auto below = [&](double ratio) { return cues.inliers < ratio * cues.reference_inliers; };
  // A queue that is too long can be worked off or sent again; a lost pose comes back by luck.
  const bool must = below(config.weak_inlier_ratio) || cues.since_map_s >= config.max_silence_s;
  if (cues.pending_keyframes >= config.max_pending && !must) return false;

  const bool need_close = cues.tracked_close < config.min_tracked_close &&
                          cues.untracked_close > config.min_untracked_close;
  const bool may = cues.pending_keyframes == 0 || cues.since_last_s >= config.max_interval_s ||
                   need_close || below(config.weak_inlier_ratio);
  const bool due =
      need_close || below(cues.keyframes < 2 ? config.first_inlier_ratio : config.min_inlier_ratio);
  return may && due;
}

}  // namespace camvox::tracking
