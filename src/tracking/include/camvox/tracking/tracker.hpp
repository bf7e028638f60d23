#pragma once

#include <cstdint>
#include <optional>

#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/frame_matcher.hpp"
#include "camvox/tracking/map_replica.hpp"
#include "camvox/tracking/motion_limit.hpp"
#include "camvox/tracking/motion_model.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::tracking {

/// Follows the camera: the pose of every frame against the map around it, and which frames become
/// keyframes (Mur-Artal & Tardos, "ORB-SLAM2", 2017, section III; Zhu et al., "CamVox", 2021).
///
///     FrameResult result = tracker.track(frame);       // for each frame, in order of time
///     if (result.keyframe) mapping takes it in and answers:
///     tracker.update_map(local_map);                   // whenever there is one
///
/// The first frame with enough depth becomes keyframe 1, with the body at the origin of `map` and
/// `odom`. New landmarks are matched from the next frame on, whether mapping has answered or not.
/// Needs no clock and no thread; the same calls give the same results, bit by bit.
class Tracker {
 public:
  /// Throws config::ConfigError with all problems of `config`.
  Tracker(const TrackerConfig& config,
          const TrackingCamera& camera,
          const geometry::SE3& T_body_camera);

  [[nodiscard]] FrameResult track(Frame frame);

  /// Takes in the newest local map. The pose goes along with its reference keyframe. Returns false
  /// when it is another map than the one that this tracker has founded (mapping outlived the
  /// tracker before): own keyframes count for nothing then, and the place in that map is looked
  /// for.
  bool update_map(LocalMap map);

  /// Answers to relocalisation requests: the place was found, or it was not.
  void relocalise(const RelocalisationHint& hint);
  void relocalisation_failed(std::uint64_t frame_id);

  /// Between two frames: of `most` own keyframes that mapping lacks one goes, see MapReplica.
  std::optional<KeyframeId> thin_out(std::size_t most);

  /// The next frames' ids begin at 1 again; their stamps go on.
  void begin_ids_anew();

  [[nodiscard]] TrackingState state() const { return state_; }
  [[nodiscard]] const MapReplica& map() const { return map_; }

 private:
  using Estimate = std::optional<optimization::PoseEstimate>;

  void start_map(Frame& frame, const FrameMatcher& matcher, FrameResult& result);
  [[nodiscard]] Estimate follow(const Frame& frame, FrameMatcher& matcher);
  [[nodiscard]] Estimate find_again(const Frame& frame, FrameMatcher& matcher);
  [[nodiscard]] Estimate find_at_hint(FrameMatcher& matcher) const;
  [[nodiscard]] Estimate find_by_looks(FrameMatcher& matcher) const;
  /// False, and counted, when nothing could have carried the camera there.
  [[nodiscard]] bool is_possible(const Frame& frame, const optimization::PoseEstimate& estimate);
  void observe_speed(const Frame& frame, const optimization::PoseEstimate& estimate, bool followed);
  [[nodiscard]] Estimate refine(FrameMatcher& matcher,
                                const geometry::SE3& T_map_camera,
                                double radius_px,
                                const std::optional<optimization::PosePrior>& prior) const;
  [[nodiscard]] std::optional<optimization::PosePrior> gyro_prior(
      const Frame& frame, const geometry::SE3& T_map_camera) const;

  void accept(Frame& frame,
              const FrameMatcher& matcher,
              const optimization::PoseEstimate& estimate,
              FrameResult& result);
  void lose(Frame& frame, FrameResult& result);
  void give_up_pose();
  void follow_map(LocalMap map);
  [[nodiscard]] bool has_map_of_place() const;
  void leave_map_for(const LocalMap& other);
  void remember(const Frame& frame, const FrameMatcher& matcher, const geometry::SE3& T_map_camera);
  void choose_reference(double median_depth_m);
  [[nodiscard]] bool is_keyframe_due(const Frame& frame,
                                     const FrameMatcher& matcher,
                                     double median_depth_m) const;
  [[nodiscard]] Keyframe make_keyframe(const Frame& frame) const;
  void add_keyframe(const Frame& frame, const FrameMatcher& matcher, FrameResult& result);
  void fill(FrameResult& result) const;
  [[nodiscard]] double median_depth_m(const FrameMatcher& matcher) const;
  /// The last pose relative to the reference keyframe.
  [[nodiscard]] geometry::SE3 T_keyframe_camera() const;
  [[nodiscard]] bool is_tracked() const {
    return state_ == TrackingState::kTracking || state_ == TrackingState::kLocalisationOnly;
  }

  TrackerConfig config_;
  TrackingCamera camera_;
  geometry::SE3 T_body_camera_;

  TrackingState state_ = TrackingState::kWaiting;
  MapReplica map_;
  MotionModel motion_;
  MotionLimit limit_;
  int refused_poses_ = 0;
  TrackedFrame last_;
  geometry::SE3 T_odom_camera_;
  KeyframeId reference_id_ = 0;
  std::uint64_t place_epoch_ = 0;  ///< Of the map that the last pose, or the proposed one, is in.
  std::int64_t last_keyframe_stamp_ns_ = 0;
  std::int64_t now_ns_ = 0;        ///< Stamp of the newest frame,
  std::int64_t map_stamp_ns_ = 0;  ///< and of the one at which the newest map came.
  int most_inliers_ = 0;           ///< Since the last keyframe.

  int frames_lost_ = 0;  ///< Since tracked, or since the last hint.
  std::optional<std::uint64_t> requested_frame_id_;
  int frames_since_request_ = 0;
};

}  // namespace camvox::tracking
