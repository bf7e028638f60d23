#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>

#include "camvox/depth/sample_depth.hpp"

namespace camvox::depth {

/// What a depth image holds, in short.
struct DepthSummary {
  double filled_share = 0.0;  ///< Of all pixels, 0 to 1.
  float nearest_m = 0.0F;     ///< 0 where no pixel has depth.
  float farthest_m = 0.0F;
};
[[nodiscard]] DepthSummary summarise(const DepthView& depth);

/// Which frame a picture shows.
struct FrameLabel {
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
};

/// "frame 12    stamp 1764064800.100000000 s    depth in 43.2 % of the pixels, 1.23 to 97.3 m"
[[nodiscard]] std::string describe(const FrameLabel& label, const DepthSummary& summary);

/// The image in grey with its depth over it in colour (red is near, blue is far, linear in inverse
/// depth), the image's brightness showing through, so that edges of depth can be compared with
/// those of the image. Below: the scale, and a line with the frame, its stamp, the share of pixels
/// with depth and their range. A small image is drawn enlarged, for the text. BGR.
///
/// `image` is grey (CV_8UC1) or BGR (CV_8UC3), of the size of `depth`; throws std::logic_error
/// otherwise. No depth at all gives the bare image and a line that says so.
[[nodiscard]] cv::Mat draw_overlay(const cv::Mat& image,
                                   const DepthView& depth,
                                   const FrameLabel& label);

}  // namespace camvox::depth
