#include "camvox/calibration/scene.hpp"

#include <opencv2/imgproc.hpp>

namespace camvox::calibration {

cv::Mat to_grey(const cv::Mat& image) {
  if (image.channels() == 1) return image;
  cv::Mat grey;
  cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  return grey;
}

}  // namespace camvox::calibration
