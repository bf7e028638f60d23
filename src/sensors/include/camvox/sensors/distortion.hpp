#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace camvox::sensors {

/// What a lens does to a direction: a point at (x, y, 1) is seen at the distorted normalised
/// coordinates (xd, yd), pixels after the focal length and principal point.
///
/// Formulas: OpenCV's camera model (calib3d), for plumb_bob as the case k4 = k5 = k6 = 0 of
/// rational_polynomial; equidistant: Kannala & Brandt, PAMI 2006.
class Distortion {
 public:
  /// A distorted point and its derivative.
  struct Result {
    Eigen::Vector2d xy_distorted;
    Eigen::Matrix2d J_xy;  ///< d(xy_distorted) / d(xy).
  };

  /// `model` and `coefficients` as in CameraIntrinsics, checked there.
  Distortion(const std::string& model, const std::vector<double>& coefficients);

  [[nodiscard]] Eigen::Vector2d apply(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Result apply_with_jacobian(const Eigen::Vector2d& xy) const;

  /// The largest |xy| up to which the model is one to one; beyond it the polynomial folds over
  /// and a point far outside the image would be "seen" inside. Infinity when it never folds.
  [[nodiscard]] double max_radius() const { return max_radius_; }

 private:
  [[nodiscard]] Result apply_radtan(const Eigen::Vector2d& xy) const;
  [[nodiscard]] Result apply_equidistant(const Eigen::Vector2d& xy) const;
  [[nodiscard]] double radial_slope(double radius) const;
  [[nodiscard]] double find_max_radius() const;

  bool equidistant_;
  std::array<double, 8> k_{};  ///< OpenCV order: k1 k2 p1 p2 k3 k4 k5 k6; equidistant: k1 to k4.
  double max_radius_;
};

}  // namespace camvox::sensors
