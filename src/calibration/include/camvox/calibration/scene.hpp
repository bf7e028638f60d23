#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace camvox::calibration {

/// What camera and lidar saw of one place while neither moved.
struct Scene {
  cv::Mat image;  ///< 8 bit, grey or BGR, distorted as the camera gives it.
  /// Returns in the lidar frame: x y z in metres, reflectivity in any unit that grows with it. A
  /// point that is not finite is ignored.
  std::vector<Eigen::Vector4f> points_lidar;
};

/// The image in grey, 8 bit; shares the data when it is grey already.
[[nodiscard]] cv::Mat to_grey(const cv::Mat& image);

}  // namespace camvox::calibration
