#include "camvox/geometry/so3.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace camvox::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

/// Farther than this from a rotation is a mistake of the caller, not rounding.
constexpr double kNotARotation = 1e-3;

/// A squared norm within this of one is that of a product of unit quaternions.
constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();

/// Below this squared angle the series beat the closed forms, which lose digits to cancellation.
constexpr double kSmallAngle2 = 1e-4;

/// (1 - cos a) / a^2.
double cosine_coefficient(double angle2) {
  if (angle2 < kSmallAngle2) return 0.5 - angle2 / 24.0 + angle2 * angle2 / 720.0;
  // 1 - cos a = 2 sin^2(a / 2) keeps all digits.
  const double half_sine = std::sin(0.5 * std::sqrt(angle2));
  return 2.0 * half_sine * half_sine / angle2;
}

/// (a - sin a) / a^3.
double sine_coefficient(double angle2) {
  if (angle2 < kSmallAngle2) return 1.0 / 6.0 - angle2 / 120.0 + angle2 * angle2 / 5040.0;
  const double angle = std::sqrt(angle2);
  return (angle - std::sin(angle)) / (angle2 * angle);
}

/// (1 - (a / 2) cot(a / 2)) / a^2.
double inverse_coefficient(double angle2) {
  if (angle2 < kSmallAngle2) return 1.0 / 12.0 + angle2 / 720.0 + angle2 * angle2 / 30240.0;
  const double half = 0.5 * std::sqrt(angle2);
  return (1.0 - half * std::cos(half) / std::sin(half)) / angle2;
}

}  // namespace

SO3::SO3(const Quaterniond& q) : q_(q) {
  const double norm = q.norm();
  if (!(std::abs(norm - 1.0) <= kNotARotation)) {
    throw std::logic_error("SO3: quaternion is not of unit norm: " + std::to_string(norm));
  }
  // A unit quaternion stays as it is, to the bit: what was written comes back the same.
  if (std::abs(q.squaredNorm() - 1.0) > kRounding) q_.coeffs() /= norm;
}

SO3 SO3::from_matrix(const Matrix3d& R) {
  const double error = (R.transpose() * R - Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= kNotARotation) || R.determinant() < 0.0) {
    throw std::logic_error("SO3: matrix is not a rotation");
  }
  return SO3(Quaterniond(R).normalized(), Unchecked{});
}

SO3 SO3::exp(const Vector3d& w) {
  const double angle2 = w.squaredNorm();
  const double angle = std::sqrt(angle2);
  const double scale = angle2 < kSmallAngle2 ? 0.5 - angle2 / 48.0 + angle2 * angle2 / 3840.0
                                             : std::sin(0.5 * angle) / angle;
  Quaterniond q;
  q.w() = std::cos(0.5 * angle);
  q.vec() = scale * w;
  return SO3(q, Unchecked{});
}

Vector3d SO3::log() const {
  // q and -q are the same rotation; a positive real part picks the shorter way round.
  const double sign = q_.w() < 0.0 ? -1.0 : 1.0;
  const double sine = q_.vec().norm();
  if (sine < 1e-10) return 2.0 * sign * q_.vec() / std::abs(q_.w());
  return 2.0 * std::atan2(sine, sign * q_.w()) / sine * sign * q_.vec();
}

double SO3::angle_rad() const { return 2.0 * std::atan2(q_.vec().norm(), std::abs(q_.w())); }

SO3 SO3::operator*(const SO3& other) const {
  Quaterniond q = q_ * other.q_;
  // One Newton step to unit norm: a long chain of products cannot drift away.
  q.coeffs() *= 0.5 * (3.0 - q.squaredNorm());
  return SO3(q, Unchecked{});
}

Matrix3d SO3::left_jacobian(const Vector3d& w) {
  const double angle2 = w.squaredNorm();
  const Matrix3d W = skew(w);
  return Matrix3d::Identity() + cosine_coefficient(angle2) * W + sine_coefficient(angle2) * W * W;
}

Matrix3d SO3::right_jacobian(const Vector3d& w) { return left_jacobian(-w); }

Matrix3d SO3::left_jacobian_inverse(const Vector3d& w) {
  const Matrix3d W = skew(w);
  return Matrix3d::Identity() - 0.5 * W + inverse_coefficient(w.squaredNorm()) * W * W;
}

Matrix3d SO3::right_jacobian_inverse(const Vector3d& w) { return left_jacobian_inverse(-w); }

SO3 interpolate(const SO3& R_a, const SO3& R_b, double ratio) {
  return R_a * SO3::exp(ratio * (R_a.inverse() * R_b).log());
}

}  // namespace camvox::geometry
