#pragma once

#include <string>

#include "camvox/calibration/scene.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::command {

/// Which part of a recording to calibrate with. The robot must stand still in it.
struct SceneOptions {
  std::string bag;
  double start_s = 0.0;  ///< After the bag's first message.
  double duration_s = 4.0;
  std::string image_topic;  ///< "": the first with images.
  std::string lidar_topic;  ///< "": the first of a Livox driver, or else with clouds.
};

/// The first image and all scans of that part. Throws CommandError.
[[nodiscard]] calibration::Scene read_scene(const SceneOptions& options,
                                            const sensors::CameraIntrinsics& camera);

}  // namespace camvox::command
