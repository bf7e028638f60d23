#include "camvox/conversion/odometry_steps.hpp"

#include <stdexcept>

#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {

using camvox_interfaces::msg::FramePose;

std::optional<CameraStep> OdometrySteps::add(const FramePose& pose) {
  const auto state = pose.state();
  const bool tracked = state == camvox_interfaces::msg::TRACKING_OK ||
                       state == camvox_interfaces::msg::TRACKING_LOCALISATION_ONLY;
  if (!tracked) {
    last_.reset();
    return std::nullopt;
  }
  const Last next{pose.header().stamp_ns(),
                  pose.map_epoch(),
                  pose.reference_keyframe_id(),
                  to_se3(pose.T_map_camera()),
                  to_se3(pose.T_keyframe_camera())};
  const auto previous = last_;
  // A little older: out of order. Much older: the clock was set back, so begin again.
  constexpr std::int64_t kClockJump_ns = 1'000'000'000;
  const bool older = previous && next.stamp_ns <= previous->stamp_ns;
  if (older && next.stamp_ns > previous->stamp_ns - kClockJump_ns) return std::nullopt;
  last_ = next;
  if (!previous || older) return std::nullopt;
  CameraStep step{previous->stamp_ns, next.stamp_ns, {}};
  if (previous->keyframe_id == next.keyframe_id) {
    step.T_from_to = previous->T_keyframe_camera.inverse() * next.T_keyframe_camera;
  } else if (previous->map_epoch == next.map_epoch) {
    step.T_from_to = previous->T_map_camera.inverse() * next.T_map_camera;
  } else {
    return std::nullopt;
  }
  return step;
}

}  // namespace camvox::conversion
