#pragma once

#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/keyframe.hpp"
#include "camvox/tracking/local_map.hpp"

namespace camvox::conversion {

/// Returns false, with empty lists, when the keyframe has more features than a message can carry.
[[nodiscard]] bool write_keyframe(const tracking::Keyframe& keyframe,
                                  camvox_interfaces::msg::Keyframe& message);

/// Throws std::invalid_argument or std::logic_error when the message contradicts itself: lists of
/// different length, numbers that are not finite, poses that nobody filled.
[[nodiscard]] tracking::Keyframe read_keyframe(const camvox_interfaces::msg::Keyframe& message);

/// What is over the message's capacity is left out: keyframes and landmarks with the lowest ids
/// stay. Returns how many were left out.
std::size_t write_local_map(const tracking::LocalMap& map,
                            camvox_interfaces::msg::LocalMap& message);
[[nodiscard]] tracking::LocalMap read_local_map(const camvox_interfaces::msg::LocalMap& message);

/// All but the processing time.
void write_frame_pose(const tracking::FrameResult& result,
                      camvox_interfaces::msg::FramePose& message);

}  // namespace camvox::conversion
