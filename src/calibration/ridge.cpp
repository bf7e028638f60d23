#include "ridge.hpp"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace camvox::calibration {
namespace {

float bilinear(const cv::Mat& image, double u, double v) {
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  const auto a = static_cast<float>(u - column);
  const auto b = static_cast<float>(v - row);
  const float* upper = image.ptr<float>(row) + column;
  const float* lower = image.ptr<float>(row + 1) + column;
  return (1 - b) * ((1 - a) * upper[0] + a * upper[1]) + b * ((1 - a) * lower[0] + a * lower[1]);
}

/// The crest through a pixel, if the pixel is the nearest to it.
std::optional<Ridge> crest(const GradientImage& gradient, int column, int row) {
  const float magnitude = gradient.magnitude.at<float>(row, column);
  const Eigen::Vector2d normal(gradient.x.at<float>(row, column) / magnitude,
                               gradient.y.at<float>(row, column) / magnitude);
  const float before = bilinear(gradient.magnitude, column - normal.x(), row - normal.y());
  const float after = bilinear(gradient.magnitude, column + normal.x(), row + normal.y());
  if (magnitude <= before || magnitude < after) return std::nullopt;
  const double shift = 0.5 * static_cast<double>(before - after) /
                       static_cast<double>(before - 2.0F * magnitude + after);
  return Ridge{column + shift * normal.x(), row + shift * normal.y(), normal, magnitude};
}

}  // namespace

GradientImage gradient(const cv::Mat& smooth) {
  GradientImage result;
  const cv::Matx13f difference(-0.5F, 0.0F, 0.5F);
  cv::filter2D(smooth, result.x, CV_32F, difference, {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::filter2D(smooth, result.y, CV_32F, difference.t(), {-1, -1}, 0, cv::BORDER_REPLICATE);
  cv::magnitude(result.x, result.y, result.magnitude);
  return result;
}

std::vector<Ridge> find_ridges(const GradientImage& gradient, float threshold, int min_length) {
  const cv::Mat& magnitude = gradient.magnitude;
  cv::Mat mask(magnitude.size(), CV_8U, cv::Scalar(0));
  std::vector<Ridge> found;
  std::vector<cv::Point> pixels;
  for (int row = 2; row < magnitude.rows - 3; ++row) {
    const float* line = magnitude.ptr<float>(row);
    for (int column = 2; column < magnitude.cols - 3; ++column) {
      if (!(line[column] > threshold)) continue;
      if (const auto ridge = crest(gradient, column, row)) {
        found.push_back(*ridge);
        pixels.emplace_back(column, row);
        mask.at<std::uint8_t>(row, column) = 255;
      }
    }
  }
  cv::Mat labels;
  cv::Mat statistics;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(mask, labels, statistics, centroids, 8, CV_32S);
  std::vector<Ridge> kept;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const int label = labels.at<int>(pixels[i]);
    if (statistics.at<int>(label, cv::CC_STAT_AREA) >= min_length) kept.push_back(found[i]);
  }
  return kept;
}

}  // namespace camvox::calibration
