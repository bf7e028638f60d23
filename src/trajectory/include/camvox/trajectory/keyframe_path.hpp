#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "camvox/trajectory/trajectory.hpp"

namespace camvox::trajectory {

/// A frame's pose relative to its reference keyframe.
struct AnchoredPose {
  std::int64_t stamp_ns = 0;
  std::uint64_t keyframe_id = 0;
  geometry::SE3 T_keyframe_camera;
  /// As tracking said it; stands where the keyframe is not known (of a map loaded elsewhere).
  std::optional<geometry::SE3> T_map_camera = {};
};

/// The path of all frames, each hung on its reference keyframe, so that it follows what bundle
/// adjustment and loop closing do to the keyframes later.
class KeyframePath {
 public:
  /// Frames come in order of time; one that is not after the last is left out.
  void add_frame(const AnchoredPose& pose);
  /// A keyframe's stamp, when it is first seen.
  void add_keyframe(std::uint64_t id, std::int64_t stamp_ns, const geometry::SE3& T_map_camera);
  /// The newest pose of a keyframe.
  void move_keyframe(std::uint64_t id, const geometry::SE3& T_map_camera);
  /// Its frames are hung on the nearest older keyframe that is left (or the next newer one), with
  /// the relative pose of this moment.
  void remove_keyframe(std::uint64_t id);

  /// T_map_camera of every frame as of now; without those whose pose is not known in any way.
  [[nodiscard]] Trajectory frames() const;
  [[nodiscard]] Trajectory keyframes() const;

 private:
  struct Keyframe {
    std::int64_t stamp_ns = 0;
    geometry::SE3 T_map_camera;
  };

  std::vector<AnchoredPose> poses_;
  std::map<std::uint64_t, Keyframe> keyframes_;
};

}  // namespace camvox::trajectory
