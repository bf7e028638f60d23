#pragma once

#include <string>

#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/rig.hpp"
#include "messages.hpp"

namespace camvox::import {

/// The text of a rig.yaml: parameters (`camera`, `rig`) for every component with a calibration.
[[nodiscard]] std::string calibration_text(const sensors::CameraIntrinsics& camera,
                                           const sensors::RigConfig& rig);

[[nodiscard]] sensors::CameraIntrinsics to_intrinsics(const CameraModel& camera);

/// A rig whose body is the camera: of recordings with a camera alone, whose truth is the camera's.
[[nodiscard]] sensors::RigConfig camera_only_rig();

}  // namespace camvox::import
