#pragma once

#include <optional>

#include "camvox/geometry/se3.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::conversion {

/// Movement of the camera between two frames, as tracking saw it.
struct CameraStep {
  std::int64_t from_ns = 0;
  std::int64_t to_ns = 0;
  geometry::SE3 T_from_to;
};

/// Makes steps of tracking's frame poses. Poses relative to the same keyframe are preferred: those
/// in the map move when the map is optimised. There is no step from or to a frame that was not
/// tracked, across a change of the map's epoch, or back in time.
class OdometrySteps {
 public:
  [[nodiscard]] std::optional<CameraStep> add(const camvox_interfaces::msg::FramePose& pose);
  /// Whether the latest frame was tracked.
  [[nodiscard]] bool tracked() const { return last_.has_value(); }

 private:
  struct Last {
    std::int64_t stamp_ns;
    std::uint64_t map_epoch;
    std::uint64_t keyframe_id;
    geometry::SE3 T_map_camera;
    geometry::SE3 T_keyframe_camera;
  };
  std::optional<Last> last_;
};

}  // namespace camvox::conversion
