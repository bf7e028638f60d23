#include "camvox/sensors/distortion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace camvox::sensors {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

/// A fraction of two polynomials in r^2 and its derivative with respect to r^2.
struct RadialFactor {
  double value;
  double derivative;
};

RadialFactor radial_factor(const std::array<double, 8>& k, double r2) {
  const double numerator = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double denominator = 1.0 + r2 * (k[5] + r2 * (k[6] + r2 * k[7]));
  const double d_numerator = k[0] + r2 * (2.0 * k[1] + 3.0 * r2 * k[4]);
  const double d_denominator = k[5] + r2 * (2.0 * k[6] + 3.0 * r2 * k[7]);
  const double value = numerator / denominator;
  return {value, (d_numerator - value * d_denominator) / denominator};
}

/// theta_d(theta) of the equidistant model and its derivative.
RadialFactor equidistant_angle(const std::array<double, 8>& k, double theta) {
  const double t2 = theta * theta;
  return {theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3])))),
          1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])))};
}

}  // namespace

Distortion::Distortion(const std::string& model, const std::vector<double>& coefficients)
    : equidistant_(model == "equidistant") {
  std::copy_n(coefficients.begin(), std::min<std::size_t>(coefficients.size(), 8), k_.begin());
  max_radius_ = find_max_radius();
}

Vector2d Distortion::apply(const Vector2d& xy) const {
  return apply_with_jacobian(xy).xy_distorted;
}

Distortion::Result Distortion::apply_with_jacobian(const Vector2d& xy) const {
  return equidistant_ ? apply_equidistant(xy) : apply_radtan(xy);
}

Distortion::Result Distortion::apply_radtan(const Vector2d& xy) const {
  const double x = xy.x();
  const double y = xy.y();
  const double p1 = k_[2];
  const double p2 = k_[3];
  const double r2 = xy.squaredNorm();
  const auto [factor, slope] = radial_factor(k_, r2);
  Result result;
  result.xy_distorted << x * factor + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
      y * factor + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
  const double cross = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
  result.J_xy << factor + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x, cross,  //
      cross, factor + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return result;
}

Distortion::Result Distortion::apply_equidistant(const Vector2d& xy) const {
  const double r = xy.norm();
  if (r < 1e-8) return {xy, Matrix2d::Identity()};
  const auto [theta_d, d_theta_d] = equidistant_angle(k_, std::atan(r));
  const double scale = theta_d / r;
  // d(theta_d / r) / dr, with d(theta) / dr = 1 / (1 + r^2).
  const double d_scale = (d_theta_d / (1.0 + r * r) - scale) / r;
  return {scale * xy, scale * Matrix2d::Identity() + (d_scale / r) * xy * xy.transpose()};
}

double Distortion::radial_slope(double radius) const {
  if (equidistant_) return equidistant_angle(k_, std::atan(radius)).derivative;
  const auto [factor, slope] = radial_factor(k_, radius * radius);
  return factor + 2.0 * radius * radius * slope;
}

double Distortion::find_max_radius() const {
  // Steps in angle, from the axis to just below 90 degrees, then bisection of the fold.
  constexpr double kStep = 0.002;
  const auto keeps_order = [&](double angle) { return radial_slope(std::tan(angle)) > 0.0; };
  for (double angle = kStep; angle < 1.5699; angle += kStep) {
    if (keeps_order(angle)) continue;
    double low = angle - kStep;
    double high = angle;
    for (int i = 0; i < 40; ++i) {
      const double middle = 0.5 * (low + high);
      (keeps_order(middle) ? low : high) = middle;
    }
    return std::tan(low);
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace camvox::sensors
