#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "camvox/features/feature_grid.hpp"
#include "camvox/features/match.hpp"
#include "camvox/optimization/pose_optimizer.hpp"
#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/map_replica.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::tracking {

/// What is left of the last tracked frame: its key points, and the landmarks that they showed.
struct TrackedFrame {
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  geometry::SE3 T_map_camera;
  std::vector<features::KeyPoint> key_points;
  std::vector<LandmarkId> landmark_ids;  ///< 0: none.
};

/// Takes the features of one frame for landmarks of the map, and finds the pose that explains
/// them. Lives as long as the frame is worked on.
class FrameMatcher {
 public:
  FrameMatcher(const features::FrameFeatures& features,
               const MapReplica& map,
               const TrackingCamera& camera,
               const TrackerConfig& config);

  /// Forgets all matches.
  void clear();

  /// Looks for the landmarks of the last frame near where they would be seen from T_map_camera.
  /// Returns the number of matches.
  int match_last_frame(const TrackedFrame& last,
                       const geometry::SE3& T_map_camera,
                       double radius_px);

  /// Looks for all other landmarks of the map that should be seen from T_map_camera. Returns the
  /// number of new matches.
  int match_local_map(const geometry::SE3& T_map_camera, double radius_px);

  /// Looks for landmarks by their looks alone, and for the pose by depth. Slow; needs no prediction
  /// but a pose around which to look. Returns the pose, and holds the matches that agree with it.
  [[nodiscard]] std::optional<geometry::SE3> match_anywhere(const geometry::SE3& T_map_camera_near);

  /// The pose from the present matches. Those that disagree with it are taken out when the status
  /// is kOk.
  [[nodiscard]] optimization::PoseEstimate optimize(
      const geometry::SE3& T_map_camera,
      const std::optional<optimization::PosePrior>& prior = std::nullopt);

  /// For each feature the landmark in the replica that it shows, or -1.
  [[nodiscard]] const std::vector<int>& landmarks() const { return landmark_of_; }
  /// The matches that the last call of optimize took out, or left without depth.
  struct Verdict {
    std::size_t landmark = 0;
    bool agreed = false;
  };
  [[nodiscard]] const std::vector<Verdict>& verdicts() const { return verdicts_; }
  [[nodiscard]] int match_count() const;
  /// Depth of a feature as it is used: 0 when it is too uncertain.
  [[nodiscard]] double usable_depth_m(std::size_t feature) const;

 private:
  [[nodiscard]] optimization::LandmarkMatch make_match(std::size_t feature) const;
  int match(const std::vector<features::Expected>& expected,
            const std::vector<std::size_t>& landmarks,
            const features::MatchConfig& match_config);

  const features::FrameFeatures& features_;
  const MapReplica& map_;
  const TrackingCamera& camera_;
  const TrackerConfig& config_;
  features::FeatureGrid grid_;
  std::vector<float> octave_scale_;
  std::vector<int> landmark_of_;
  std::vector<std::uint8_t> taken_;   ///< Of features.
  std::vector<std::uint8_t> in_use_;  ///< Of landmarks.
  std::vector<Verdict> verdicts_;
};

}  // namespace camvox::tracking
