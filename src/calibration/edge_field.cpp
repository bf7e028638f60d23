#include "edge_field.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace camvox::calibration {
namespace {

constexpr int kMinEdgeLength_px = 8;

/// The value below which a share of the image's values lies; samples every third pixel.
float quantile(const cv::Mat& image, double share) {
  std::vector<float> values;
  for (int row = 0; row < image.rows; row += 3) {
    const float* line = image.ptr<float>(row);
    for (int column = 0; column < image.cols; column += 3) values.push_back(line[column]);
  }
  if (values.empty()) return 0.0F;
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

}  // namespace

int EdgeField::direction(const Eigen::Vector2d& normal) {
  const double turn = std::atan2(normal.y(), normal.x()) / std::numbers::pi + 1.0;  // 0 to 2
  return static_cast<int>(std::lround(turn * kDirections)) % kDirections;
}

EdgeField::EdgeField(const std::vector<Ridge>& edges, cv::Size image_size, double sigma_px)
    : sigma_px_(sigma_px), stride_px_(std::max(1.0, std::floor(sigma_px / 3.0))) {
  const cv::Size size(static_cast<int>((image_size.width - 1) / stride_px_) + 2,
                      static_cast<int>((image_size.height - 1) / stride_px_) + 2);
  std::vector<cv::Mat> sharp;
  for (int i = 0; i < kDirections; ++i) sharp.emplace_back(size, CV_32F, cv::Scalar(0));
  for (const Ridge& edge : edges) {
    const int row = static_cast<int>(std::lround(edge.v / stride_px_));
    const int column = static_cast<int>(std::lround(edge.u / stride_px_));
    sharp[static_cast<std::size_t>(direction(edge.normal))].at<float>(row, column) += edge.strength;
  }
  double total = 0.0;
  for (int i = 0; i < kDirections; ++i) {
    // An edge counts half in the neighbouring directions.
    const auto at = [&](int k) -> const cv::Mat& {
      return sharp[static_cast<std::size_t>((k + kDirections) % kDirections)];
    };
    cv::Mat field = at(i) + 0.5 * at(i - 1) + 0.5 * at(i + 1);
    const double sigma = sigma_px / stride_px_;
    cv::GaussianBlur(field, field, {}, sigma, sigma, cv::BORDER_CONSTANT);
    total += cv::mean(field)[0];
    density_.push_back(field);
  }
  const double mean = total / kDirections;
  if (mean > 0.0) {
    for (cv::Mat& field : density_) field *= 1.0 / mean;
  }
}

FieldSample EdgeField::sample(const Eigen::Vector2d& u_px, const Eigen::Vector2d& normal) const {
  const cv::Mat& field = density_[static_cast<std::size_t>(direction(normal))];
  const double x = u_px.x() / stride_px_;
  const double y = u_px.y() / stride_px_;
  if (!(x >= 0.0 && y >= 0.0 && x < field.cols - 1 && y < field.rows - 1)) return {};
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const auto a = static_cast<float>(x - column);
  const auto b = static_cast<float>(y - row);
  const float* upper = field.ptr<float>(row) + column;
  const float* lower = field.ptr<float>(row + 1) + column;
  const float top = (1 - a) * upper[0] + a * upper[1];
  const float bottom = (1 - a) * lower[0] + a * lower[1];
  const float left = (1 - b) * upper[0] + b * lower[0];
  const float right = (1 - b) * upper[1] + b * lower[1];
  const auto per_px = static_cast<float>(1.0 / stride_px_);
  return {(1 - b) * top + b * bottom, {(right - left) * per_px, (bottom - top) * per_px}};
}

float EdgeField::density(const Eigen::Vector2d& u_px, const Eigen::Vector2d& normal) const {
  const cv::Mat& field = density_[static_cast<std::size_t>(direction(normal))];
  const double x = u_px.x() / stride_px_ + 0.5;
  const double y = u_px.y() / stride_px_ + 0.5;
  if (!(x >= 0.0 && y >= 0.0 && x < field.cols && y < field.rows)) return 0.0F;
  return field.at<float>(static_cast<int>(y), static_cast<int>(x));
}

ImageEdges::ImageEdges(const cv::Mat& grey, double sigma_px) : sigma_px_(sigma_px) {
  cv::Mat brightness;
  grey.convertTo(brightness, CV_32F, 1.0, 8.0);
  cv::log(brightness, brightness);
  cv::GaussianBlur(brightness, brightness, {}, sigma_px, sigma_px, cv::BORDER_REPLICATE);
  GradientImage slope = gradient(brightness);
  const float middle = std::max(1e-4F, quantile(slope.magnitude, 0.8));
  // The strongest edges must not outvote the many: compress to below 1.
  const cv::Mat scale = 1.0 / (slope.magnitude + middle);
  cv::merge(std::vector<cv::Mat>{slope.x.mul(scale), slope.y.mul(scale)}, contrast_);
  ridges_ = find_ridges(slope, 0.6F * middle, kMinEdgeLength_px);
  for (Ridge& ridge : ridges_) ridge.strength /= ridge.strength + middle;
}

float ImageEdges::contrast(const Eigen::Vector2d& u_px, const Eigen::Vector2d& normal) const {
  const double x = u_px.x();
  const double y = u_px.y();
  if (!(x >= 0.0 && y >= 0.0 && x < contrast_.cols - 1 && y < contrast_.rows - 1)) return 0.0F;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const auto a = static_cast<float>(x - column);
  const auto b = static_cast<float>(y - row);
  const auto* upper = contrast_.ptr<cv::Vec2f>(row) + column;
  const auto* lower = contrast_.ptr<cv::Vec2f>(row + 1) + column;
  const auto nx = static_cast<float>(normal.x());
  const auto ny = static_cast<float>(normal.y());
  const auto across = [&](const cv::Vec2f& contrast) {
    return contrast[0] * nx + contrast[1] * ny;
  };
  return std::abs((1 - b) * ((1 - a) * across(upper[0]) + a * across(upper[1])) +
                  b * ((1 - a) * across(lower[0]) + a * across(lower[1])));
}

}  // namespace camvox::calibration
