#pragma once

#include "camvox/features/feature.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::conversion {

/// Writes the lists of `message`. Returns false, and leaves the lists empty, when there are more
/// features than a message can carry.
[[nodiscard]] bool write_features(const features::FrameFeatures& features,
                                  camvox_interfaces::msg::Keyframe& message);

/// The features of a keyframe message. Throws std::invalid_argument when its lists differ in
/// length or a number is not finite.
[[nodiscard]] features::FrameFeatures read_features(
    const camvox_interfaces::msg::Keyframe& message);

}  // namespace camvox::conversion
