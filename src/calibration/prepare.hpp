#pragma once

#include <stop_token>
#include <vector>

#include "alignment.hpp"
#include "camvox/calibration/calibrator.hpp"

namespace camvox::calibration {

/// What of the surroundings matters for a camera, with a margin for a wrong guess.
[[nodiscard]] LidarView view_of(const sensors::CameraIntrinsics& intrinsics,
                                const geometry::SE3& T_camera_lidar,
                                double margin_rad);

/// The scenes ready for alignment, or why there are none.
struct Preparation {
  CalibrationStatus status = CalibrationStatus::kDone;
  std::vector<PreparedScene> scenes;
};
[[nodiscard]] Preparation prepare(const std::vector<Scene>& scenes,
                                  const sensors::CameraIntrinsics& intrinsics,
                                  const geometry::SE3& T_camera_lidar_guess,
                                  const CalibrationConfig& config,
                                  const std::stop_token& stop);

}  // namespace camvox::calibration
