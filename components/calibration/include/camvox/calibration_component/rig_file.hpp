#pragma once

#include <filesystem>
#include <string>

#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox::calibration_component {

/// Camera and rig as a parameter file for `camvox run --parameters`.
[[nodiscard]] std::string rig_file_text(const sensors::CameraIntrinsics& camera,
                                        const sensors::RigConfig& rig);

/// Lines of text as comments for the top of such a file.
[[nodiscard]] std::string as_comment(const std::string& text);

/// Writes it beside the old file, then replaces that one in a single step. Returns what went wrong,
/// or "".
[[nodiscard]] std::string write_rig_file(const std::filesystem::path& path,
                                         const std::string& text);

}  // namespace camvox::calibration_component
