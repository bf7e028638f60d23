#pragma once

#include <string_view>

#include "camvox/config/parameters.hpp"

namespace camvox::tracking {

/// When a frame becomes a keyframe. YAML keys are the field names.
struct KeyframeConfig {
  double max_interval_s = 1.0;      ///< After that long a keyframe may come while mapping is busy.
  double min_inlier_ratio = 0.75;   ///< Below this share of the reference's inliers one is due.
  double first_inlier_ratio = 0.4;  ///< The same while the map has one keyframe.
  double weak_inlier_ratio = 0.25;  ///< Below this one is due even while mapping is busy.
  int min_tracked_close = 100;      ///< Fewer tracked close points than this, and ...
  int min_untracked_close = 70;     ///< ... more untracked ones than this: one is due.
  int min_inliers = 15;             ///< Never with fewer than that.
  /// No keyframe before the camera has moved by this share of the median depth ...
  double min_baseline_ratio = 0.01;
  double min_rotation_deg = 2.0;  ///< ... or turned by that much.
  /// Keyframes that mapping has not yet taken in. With so many only a weak frame becomes one, until
  /// no map has come for max_silence_s: then mapping is away, and tracking must do without.
  int max_pending = 3;
  double max_silence_s = 2.0;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("max_interval_s", self.max_interval_s, config::greater_than(0.0));
    field("min_inlier_ratio", self.min_inlier_ratio, config::at_least(0.0), config::at_most(1.0));
    field(
        "first_inlier_ratio", self.first_inlier_ratio, config::at_least(0.0), config::at_most(1.0));
    field("weak_inlier_ratio", self.weak_inlier_ratio, config::at_least(0.0), config::at_most(1.0));
    field("min_tracked_close", self.min_tracked_close, config::at_least(0));
    field("min_untracked_close", self.min_untracked_close, config::at_least(0));
    field("min_inliers", self.min_inliers, config::at_least(0));
    field("min_baseline_ratio", self.min_baseline_ratio, config::at_least(0.0));
    field("min_rotation_deg", self.min_rotation_deg, config::at_least(0.0));
    field("max_pending", self.max_pending, config::at_least(1));
    field("max_silence_s", self.max_silence_s, config::greater_than(0.0));
  }
};

/// What the decision looks at.
struct KeyframeCues {
  int inliers = 0;
  int reference_inliers = 0;  ///< The most since the last keyframe was made.
  int tracked_close = 0;      ///< Features with depth that are inliers.
  int untracked_close = 0;    ///< Features with depth that are not.
  int pending_keyframes = 0;  ///< That mapping has not yet taken in; 0: it is idle.
  int keyframes = 0;          ///< In the local map.
  double since_last_s = 0.0;
  double since_map_s = 0.0;     ///< Since mapping's newest local map.
  double baseline_ratio = 0.0;  ///< Distance to the nearest keyframe over the median depth.
  double rotation_rad = 0.0;    ///< Angle to that keyframe.
};

/// Whether a frame becomes a keyframe (Mur-Artal & Tardos, "ORB-SLAM2", 2017, section III.E). What
/// we changed: a camera that does not move makes none, whatever it sees; the reference count is
/// the best since the last keyframe, not a count of the map's.
[[nodiscard]] bool is_keyframe(const KeyframeCues& cues, const KeyframeConfig& config);

}  // namespace camvox::tracking
