#pragma once

#include <cstdint>
#include <optional>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::tracking {

/// What tracking is doing. The numbers are those of TRACKING_* in the messages.
enum class TrackingState : std::uint8_t {
  kWaiting = 0,           ///< No map yet: waits for a frame with enough depth.
  kTracking = 1,          ///< The pose is known.
  kLost = 2,              ///< The pose is not known; looks for it around the last one.
  kRelocalising = 3,      ///< A place was proposed; looks for the pose there.
  kLocalisationOnly = 4,  ///< The pose is known, and the map stays as it is.
};

/// One camera frame with its features; depth has been sampled already.
struct Frame {
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  features::FrameFeatures features;
  /// Rotation from this camera frame to the previous one, from the gyro.
  std::optional<geometry::SO3> R_previous_camera;
};

/// Counts of one frame, for status messages.
struct FrameStatistics {
  int features = 0;
  int features_with_depth = 0;
  int matches = 0;  ///< Features taken for a landmark.
  int inliers = 0;  ///< Of these, those that agree with the pose.
  int inliers_with_depth = 0;
  int banned_landmarks = 0;   ///< Landmarks that disagreed too often, e.g. on moving objects.
  double chi2_per_row = 0.0;  ///< Mean squared residual; about 1 when all is well.
  int refused_poses = 0;  ///< So far: poses that the camera cannot have come to, see MotionLimit.
};

/// What tracking says of one frame.
struct FrameResult {
  TrackingState state = TrackingState::kWaiting;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t map_epoch = 0;
  KeyframeId reference_keyframe_id = 0;
  /// Poses are those of the last tracked frame when the state is not kTracking or
  /// kLocalisationOnly.
  geometry::SE3 T_map_camera;
  geometry::SE3 T_keyframe_camera;  ///< Relative to the reference keyframe.
  geometry::SE3 T_odom_camera;      ///< Sum of the relative motions: corrections leave it alone.
  geometry::Matrix6d covariance_camera = geometry::Matrix6d::Zero();
  Eigen::Vector3d velocity_camera = Eigen::Vector3d::Zero();          ///< m/s
  Eigen::Vector3d angular_velocity_camera = Eigen::Vector3d::Zero();  ///< rad/s
  FrameStatistics statistics;
  std::optional<Keyframe> keyframe;                ///< The frame, when it becomes a keyframe.
  std::optional<Keyframe> relocalisation_request;  ///< The frame, when its place is wanted.

  [[nodiscard]] bool has_pose() const {
    return state == TrackingState::kTracking || state == TrackingState::kLocalisationOnly;
  }
};

/// Where a lost frame was taken, as loop closing found out.
struct RelocalisationHint {
  std::uint64_t frame_id = 0;
  std::uint64_t map_epoch = 0;
  KeyframeId keyframe_id = 0;  ///< The most similar keyframe.
  geometry::SE3 T_map_camera;
};

}  // namespace camvox::tracking
