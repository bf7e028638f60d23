#pragma once

#include <opencv2/core.hpp>

#include "camvox/conversion/image.hpp"

namespace camvox::conversion {

/// A copy of a well-formed image (`is_well_formed`) as OpenCV's functions take it: CV_8UC3, blue,
/// green, red. For users that link OpenCV's core; the library itself does not.
[[nodiscard]] inline cv::Mat to_bgr(const camvox_interfaces::msg::FrameImage& image) {
  cv::Mat bgr(static_cast<int>(image.height_px()), static_cast<int>(image.width_px()), CV_8UC3);
  for (int v = 0; v < bgr.rows; ++v) {
    for (int u = 0; u < bgr.cols; ++u) {
      const auto pixel = bgr_at(image, u, v);
      bgr.at<cv::Vec3b>(v, u) = {pixel[0], pixel[1], pixel[2]};
    }
  }
  return bgr;
}

}  // namespace camvox::conversion
