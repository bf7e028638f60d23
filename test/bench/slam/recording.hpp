#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "camvox/depth/depth_projector.hpp"
#include "camvox/depth/sample_depth.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::bench {

/// Lidar returns of a sweep, with the time of each after the image.
struct Sweep {
  std::vector<Eigen::Vector3f> points_lidar;
  std::vector<float> after_image_s;
};

/// An image and what belongs to it, still compressed.
struct RecordedFrame {
  std::int64_t stamp_ns = 0;
  std::vector<std::uint8_t> image_file;  ///< PNG or JPEG.
  cv::Mat depth_mm;                      ///< 16 bit; empty: none.
  std::optional<Sweep> sweep;
  std::optional<geometry::SE3> T_truth_body;
};

/// A bag of `camvox import`: 7scenes, tum-rgbd or kitti-raw.
struct Recording {
  sensors::CameraIntrinsics intrinsics;
  geometry::SE3 T_body_camera;
  geometry::SE3 T_body_lidar;
  std::vector<RecordedFrame> frames;
};

/// Throws std::runtime_error when the bag cannot be read or lacks images or their camera_info.
[[nodiscard]] Recording read_recording(const std::filesystem::path& bag);

/// Depth aligned with the image; keeps its memory from frame to frame.
class DepthSource {
 public:
  /// `plain`: the nearest return of each pixel instead of the depth library's projection, to tell
  /// errors of the two from those of tracking.
  DepthSource(const Recording& recording, bool plain)
      : recording_(recording),
        plain_(plain),
        projector_(sensors::CameraModel(recording.intrinsics), {}) {}

  /// Of a depth camera, with a Kinect's sigma (Nguyen et al., 3DIMPVT 2012); or of the sweep,
  /// moved to the image's time by the twist of the camera [rotation; translation] and projected.
  [[nodiscard]] depth::DepthView depth_of(const RecordedFrame& frame,
                                          const geometry::Vector6d& twist_camera);

 private:
  void from_depth_image(const cv::Mat& depth_mm);
  void from_sweep(const Sweep& sweep, const geometry::Vector6d& twist_camera);
  void project_plainly(const depth::ScanView& scan);

  const Recording& recording_;
  bool plain_;
  depth::DepthProjector projector_;
  std::vector<float> points_lidar_;  ///< x y z 0 of each return.
  std::vector<float> depth_m_;
  std::vector<float> sigma_m_;
};

}  // namespace camvox::bench
