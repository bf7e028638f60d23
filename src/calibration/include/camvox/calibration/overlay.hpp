#pragma once

#include <opencv2/core/mat.hpp>

#include "camvox/calibration/lidar_edges.hpp"
#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::calibration {

/// The image in dim grey, with the lidar's edges drawn over it under the given extrinsics: green
/// where reflectivity changes, red where a nearer surface ends. They lie on the edges of the image
/// when the extrinsics are right: below it three details (framed in the image) are magnified, where
/// one sees a pixel. BGR; as wide as the image, and higher.
[[nodiscard]] cv::Mat draw_overlay(const Scene& scene,
                                   const sensors::CameraIntrinsics& intrinsics,
                                   const geometry::SE3& T_camera_lidar,
                                   const LidarEdgeConfig& config = {});

}  // namespace camvox::calibration
