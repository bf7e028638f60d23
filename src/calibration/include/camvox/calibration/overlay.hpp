#pragma once

#include <opencv2/core/mat.hpp>

#include "camvox/calibration/lidar_edges.hpp"
#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::calibration {

/// The image, darkened, with the lidar's edges drawn over it under the given extrinsics: green
/// where reflectivity changes, red where a nearer surface ends. They lie on the edges of the image
/// when the extrinsics are right. BGR.
[[nodiscard]] cv::Mat draw_overlay(const Scene& scene,
                                   const sensors::CameraIntrinsics& intrinsics,
                                   const geometry::SE3& T_camera_lidar,
                                   const LidarEdgeConfig& config = {});

}  // namespace camvox::calibration
