#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace camvox::calibration {

/// First derivatives of a smooth image.
struct GradientImage {
  cv::Mat x;          ///< 32F, per pixel.
  cv::Mat y;          ///< 32F.
  cv::Mat magnitude;  ///< 32F.
};

/// Central differences; the caller has smoothed.
[[nodiscard]] GradientImage gradient(const cv::Mat& smooth);

/// A point on the crest of the gradient's magnitude.
struct Ridge {
  double u = 0.0;  ///< To a fraction of a pixel.
  double v = 0.0;
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< Direction of the gradient.
  float strength = 0.0F;                              ///< Magnitude of the gradient.
};

/// The crests above `threshold` in chains of at least `min_length` pixels, in the order of rows.
[[nodiscard]] std::vector<Ridge> find_ridges(const GradientImage& gradient,
                                             float threshold,
                                             int min_length);

}  // namespace camvox::calibration
