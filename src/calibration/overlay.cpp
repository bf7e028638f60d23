#include "camvox/calibration/overlay.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "camvox/sensors/camera_model.hpp"
#include "prepare.hpp"

namespace camvox::calibration {

cv::Mat draw_overlay(const Scene& scene,
                     const sensors::CameraIntrinsics& intrinsics,
                     const geometry::SE3& T_camera_lidar,
                     const LidarEdgeConfig& config) {
  cv::Mat picture;
  if (scene.image.channels() == 1) {
    cv::cvtColor(scene.image, picture, cv::COLOR_GRAY2BGR);
  } else {
    picture = scene.image.clone();
  }
  picture *= 0.7;
  const sensors::CameraModel camera(intrinsics);
  const LidarEdges lidar =
      extract_lidar_edges(scene.points_lidar, view_of(intrinsics, T_camera_lidar, 0.1), config);
  for (const LidarEdge& edge : lidar.edges) {
    const auto u_px = camera.project(T_camera_lidar * edge.p_lidar);
    if (!u_px || !camera.contains(*u_px, 1.0)) continue;
    const cv::Point at(static_cast<int>(std::lround(u_px->x())),
                       static_cast<int>(std::lround(u_px->y())));
    const bool depth = edge.kind == EdgeKind::kDepth;
    cv::circle(picture, at, 1, depth ? cv::Scalar(60, 60, 255) : cv::Scalar(60, 255, 60), -1);
  }
  return picture;
}

}  // namespace camvox::calibration
