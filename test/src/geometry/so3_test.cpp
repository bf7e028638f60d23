#include "camvox/geometry/so3.hpp"

#include <gmock/gmock.h>

#include <limits>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

namespace camvox::geometry {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;

/// Rotation vectors of all sizes: zero, around the switch to series, ordinary, close to pi.
std::vector<Vector3d> rotation_vectors() {
  std::vector<Vector3d> vectors = {Vector3d::Zero()};
  const Vector3d axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, -0.8, 0}, {-0.36, 0.48, 0.8}};
  for (const double angle : {1e-12, 1e-8, 1e-5, 0.0099, 0.0101, 0.3, 1.0, 2.5, 3.1, kPi - 1e-9}) {
    for (const auto& axis : axes) vectors.push_back(angle * axis);
  }
  return vectors;
}

TEST(SO3, ExpEqualsTheMatrixExponential) {
  for (const auto& w : rotation_vectors()) {
    const Matrix3d expected = skew(w).exp();
    EXPECT_LT((SO3::exp(w).matrix() - expected).norm(), 1e-14) << w.transpose();
  }
}

TEST(SO3, LogInvertsExpUpToPi) {
  for (const auto& w : rotation_vectors()) {
    // Relative to the angle: the smallest vectors must keep their digits too.
    EXPECT_LT((SO3::exp(w).log() - w).norm(), 1e-14 * std::max(w.norm(), 1e-3)) << w.transpose();
    EXPECT_NEAR(SO3::exp(w).angle_rad(), w.norm(), 1e-14);
  }
}

TEST(SO3, LogTakesTheShorterWayRound) {
  EXPECT_TRUE(SO3::exp({0, 0, kPi + 0.1}).log().isApprox(Vector3d(0, 0, -kPi + 0.1), 1e-12));
  const Quaterniond q(Eigen::AngleAxisd(0.2, Vector3d::UnitX()));
  EXPECT_TRUE(SO3(Quaterniond(-q.coeffs())).log().isApprox(Vector3d(0.2, 0, 0), 1e-12));
}

TEST(SO3, HalfTurnGivesAnAxisOfEitherSign) {
  const Vector3d w = SO3::from_matrix(Vector3d(1, -1, -1).asDiagonal()).log();
  EXPECT_NEAR(w.cwiseAbs().x(), kPi, 1e-12);
  EXPECT_NEAR(w.tail<2>().norm(), 0.0, 1e-12);
}

TEST(SO3, ComposesAsMatricesDo) {
  const SO3 R_a = SO3::exp({0.1, -0.4, 0.9});
  const SO3 R_b = SO3::exp({-1.0, 0.2, 0.3});
  EXPECT_LT(((R_a * R_b).matrix() - R_a.matrix() * R_b.matrix()).norm(), 1e-14);
  EXPECT_LT((R_a.inverse().matrix() - R_a.matrix().transpose()).norm(), 1e-14);
  const Vector3d v(1, 2, 3);
  EXPECT_LT((R_a * v - R_a.matrix() * v).norm(), 1e-14);
  // A quarter turn to the left takes forward to left.
  EXPECT_LT((SO3::exp({0, 0, kPi / 2}) * Vector3d::UnitX() - Vector3d::UnitY()).norm(), 1e-15);
}

TEST(SO3, LongChainsStayUnit) {
  SO3 R;
  for (int i = 0; i < 1'000'000; ++i) R = R * SO3::exp({1e-3, 2e-3, -1e-3});
  EXPECT_NEAR(R.quaternion().norm(), 1.0, 1e-14);
}

TEST(SO3, JacobiansAgreeWithFiniteDifferences) {
  // Central differences of step 1e-6: truncation 1e-12, rounding 1e-10.
  constexpr double kStep = 1e-6;
  for (const auto& w : rotation_vectors()) {
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d d = kStep * Vector3d::Unit(axis);
      const Vector3d right = (SO3::exp(w - d).inverse() * SO3::exp(w + d)).log() / (2.0 * kStep);
      const Vector3d left = (SO3::exp(w + d) * SO3::exp(w - d).inverse()).log() / (2.0 * kStep);
      EXPECT_LT((SO3::right_jacobian(w).col(axis) - right).norm(), 1e-9) << w.transpose();
      EXPECT_LT((SO3::left_jacobian(w).col(axis) - left).norm(), 1e-9) << w.transpose();
    }
  }
}

TEST(SO3, JacobianInversesAreInverses) {
  for (const auto& w : rotation_vectors()) {
    const Matrix3d right = SO3::right_jacobian(w) * SO3::right_jacobian_inverse(w);
    const Matrix3d left = SO3::left_jacobian_inverse(w) * SO3::left_jacobian(w);
    EXPECT_LT((right - Matrix3d::Identity()).norm(), 1e-12) << w.transpose();
    EXPECT_LT((left - Matrix3d::Identity()).norm(), 1e-12) << w.transpose();
  }
}

TEST(SO3, AdjointMovesAPerturbationToTheLeft) {
  const SO3 R = SO3::exp({0.5, -0.7, 1.1});
  const Vector3d w(0.3, 0.2, -0.4);
  const Matrix3d difference = (R * SO3::exp(w)).matrix() - (SO3::exp(R.adjoint() * w) * R).matrix();
  EXPECT_LT(difference.norm(), 1e-14);
}

TEST(SO3, InterpolatesAtConstantRate) {
  const SO3 R_a = SO3::exp({0.1, 0.2, 0.3});
  const Vector3d w(0.4, -1.0, 0.2);
  const SO3 R_b = R_a * SO3::exp(w);
  for (const double ratio : {0.0, 0.25, 1.0, 1.5}) {
    const SO3 expected = R_a * SO3::exp(ratio * w);
    EXPECT_LT((interpolate(R_a, R_b, ratio).inverse() * expected).angle_rad(), 1e-14);
  }
}

TEST(SO3, RefusesWhatIsNoRotation) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(SO3(Quaterniond(0, 0, 0, 0)), std::logic_error);
  EXPECT_THROW(SO3(Quaterniond(2, 0, 0, 0)), std::logic_error);
  EXPECT_THROW(SO3(Quaterniond(nan, 0, 0, 1)), std::logic_error);
  EXPECT_THROW((void)SO3::from_matrix(Vector3d(1, 1, -1).asDiagonal()), std::logic_error);
  EXPECT_THROW((void)SO3::from_matrix(2.0 * Matrix3d::Identity()), std::logic_error);
  EXPECT_THROW((void)SO3::from_matrix(Matrix3d::Constant(nan)), std::logic_error);
}

}  // namespace
}  // namespace camvox::geometry
