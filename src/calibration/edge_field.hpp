#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "ridge.hpp"

namespace camvox::calibration {

/// A sample of a field: how dense image edges of the wanted direction are around a pixel, as a
/// multiple of their mean over the image, and the derivative of that.
struct FieldSample {
  float density = 0.0F;
  Eigen::Vector2f slope_px = Eigen::Vector2f::Zero();
};

/// Where in the image edges of which direction are, smoothed by a Gaussian: what a distance
/// transform gives, but smooth, with all edges in reach instead of the nearest, and by direction.
class EdgeField {
 public:
  /// `sigma_px` may be large: the field is stored in steps of a third of it.
  EdgeField(const std::vector<Ridge>& edges, cv::Size image_size, double sigma_px);

  /// `normal` is the direction across the wanted edge; its sign does not matter. Outside the image
  /// the density is 0.
  [[nodiscard]] FieldSample sample(const Eigen::Vector2d& u_px,
                                   const Eigen::Vector2d& normal) const;
  [[nodiscard]] float density(const Eigen::Vector2d& u_px, const Eigen::Vector2d& normal) const;
  [[nodiscard]] double sigma_px() const { return sigma_px_; }

 private:
  static constexpr int kDirections = 8;
  [[nodiscard]] static int direction(const Eigen::Vector2d& normal);

  double sigma_px_;
  double stride_px_;
  std::vector<cv::Mat> density_;  ///< One for each direction, 32F.
};

/// The camera's side of the problem, computed once for each image.
class ImageEdges {
 public:
  /// Smooths with `sigma_px`, which should be near what the lidar's edges were found under.
  ImageEdges(const cv::Mat& grey, double sigma_px);

  /// Crests of the contrast, strengths between 0 and 1.
  [[nodiscard]] const std::vector<Ridge>& ridges() const { return ridges_; }
  [[nodiscard]] cv::Size size() const { return contrast_.size(); }
  [[nodiscard]] double sigma_px() const { return sigma_px_; }

  /// Contrast across a direction at a pixel, 0 to 1; 0 outside.
  [[nodiscard]] float contrast(const Eigen::Vector2d& u_px, const Eigen::Vector2d& normal) const;

 private:
  double sigma_px_;
  cv::Mat contrast_;  ///< 32FC2; gradient of the log brightness, compressed to below 1.
  std::vector<Ridge> ridges_;
};

}  // namespace camvox::calibration
