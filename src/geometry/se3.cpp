#include "camvox/geometry/se3.hpp"

#include <cmath>
#include <stdexcept>

namespace camvox::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// The three scalar factors of Q in Barfoot (7.86b), with a for the angle.
struct CouplingFactors {
  double first;   ///< (a - sin a) / a^3
  double second;  ///< (a^2 + 2 cos a - 2) / (2 a^4)
  double third;   ///< (2 a - 3 sin a + a cos a) / (2 a^5)
};

CouplingFactors coupling_factors(double angle2) {
  // The closed forms cancel up to the fifth power of the angle: at 0.2 rad the series with four
  // terms and the closed forms both hold 1e-12.
  if (angle2 < 0.04) {
    const double x = angle2;
    return {1.0 / 6.0 - x / 120.0 + x * x / 5040.0 - x * x * x / 362880.0,
            1.0 / 24.0 - x / 720.0 + x * x / 40320.0 - x * x * x / 3628800.0,
            1.0 / 120.0 - x / 2520.0 + x * x / 120960.0 - x * x * x / 9979200.0};
  }
  const double angle = std::sqrt(angle2);
  const double sine = std::sin(angle);
  const double cosine = std::cos(angle);
  return {(angle - sine) / (angle2 * angle),
          (angle2 + 2.0 * cosine - 2.0) / (2.0 * angle2 * angle2),
          (2.0 * angle - 3.0 * sine + angle * cosine) / (2.0 * angle2 * angle2 * angle)};
}

/// How a rotation tangent moves the translation in the left Jacobian: Q of Barfoot (7.86b).
Matrix3d coupling(const Vector3d& w, const Vector3d& v) {
  const CouplingFactors factor = coupling_factors(w.squaredNorm());
  const Matrix3d W = skew(w);
  const Matrix3d V = skew(v);
  const Matrix3d WV = W * V;
  const Matrix3d VW = V * W;
  const Matrix3d WVW = WV * W;
  return 0.5 * V + factor.first * (WV + VW + WVW) + factor.second * (W * WV + VW * W - 3.0 * WVW) +
         factor.third * (WVW * W + W * WVW);
}

}  // namespace

SE3 SE3::from_matrix(const Eigen::Matrix4d& T) {
  if (!(T.row(3) - Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)).isZero(1e-9)) {
    throw std::logic_error("SE3: last row of the matrix is not 0 0 0 1");
  }
  return {SO3::from_matrix(T.topLeftCorner<3, 3>()), T.topRightCorner<3, 1>()};
}

SE3 SE3::exp(const Vector6d& xi) {
  const Vector3d w = xi.head<3>();
  return {SO3::exp(w), SO3::left_jacobian(w) * xi.tail<3>()};
}

Vector6d SE3::log() const {
  Vector6d xi;
  const Vector3d w = rotation_.log();
  xi << w, SO3::left_jacobian_inverse(w) * translation_;
  return xi;
}

Eigen::Matrix4d SE3::matrix() const {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = rotation_.matrix();
  T.topRightCorner<3, 1>() = translation_;
  return T;
}

Matrix6d SE3::adjoint() const {
  const Matrix3d R = rotation_.matrix();
  Matrix6d Ad = Matrix6d::Zero();
  Ad.topLeftCorner<3, 3>() = R;
  Ad.bottomRightCorner<3, 3>() = R;
  Ad.bottomLeftCorner<3, 3>() = skew(translation_) * R;
  return Ad;
}

Matrix6d SE3::left_jacobian(const Vector6d& xi) {
  const Matrix3d J = SO3::left_jacobian(xi.head<3>());
  Matrix6d jacobian = Matrix6d::Zero();
  jacobian.topLeftCorner<3, 3>() = J;
  jacobian.bottomRightCorner<3, 3>() = J;
  jacobian.bottomLeftCorner<3, 3>() = coupling(xi.head<3>(), xi.tail<3>());
  return jacobian;
}

Matrix6d SE3::right_jacobian(const Vector6d& xi) { return left_jacobian(-xi); }

Matrix6d SE3::left_jacobian_inverse(const Vector6d& xi) {
  const Matrix3d J_inverse = SO3::left_jacobian_inverse(xi.head<3>());
  Matrix6d inverse = Matrix6d::Zero();
  inverse.topLeftCorner<3, 3>() = J_inverse;
  inverse.bottomRightCorner<3, 3>() = J_inverse;
  inverse.bottomLeftCorner<3, 3>() = -J_inverse * coupling(xi.head<3>(), xi.tail<3>()) * J_inverse;
  return inverse;
}

Matrix6d SE3::right_jacobian_inverse(const Vector6d& xi) { return left_jacobian_inverse(-xi); }

SE3 interpolate(const SE3& T_a, const SE3& T_b, double ratio) {
  return T_a * SE3::exp(ratio * local(T_a, T_b));
}

}  // namespace camvox::geometry
