#include "camvox/geometry/se3.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <unsupported/Eigen/MatrixFunctions>

namespace camvox::geometry {
namespace {

using Eigen::Matrix4d;
using Eigen::Vector3d;

std::vector<Vector6d> twists() {
  std::vector<Vector6d> all = {Vector6d::Zero()};
  const Vector3d axes[] = {{1, 0, 0}, {0, 0, 1}, {-0.36, 0.48, 0.8}};
  for (const double angle : {0.0, 1e-10, 1e-5, 0.01, 0.1999, 0.2001, 1.0, 2.5, 3.14159}) {
    for (const auto& axis : axes) {
      Vector6d xi;
      xi << angle * axis, 1.5, -0.7, 3.0;
      all.push_back(xi);
    }
  }
  return all;
}

/// The 4x4 matrix of a twist, whose matrix exponential is the transform.
Matrix4d hat(const Vector6d& xi) {
  Matrix4d matrix = Matrix4d::Zero();
  matrix.topLeftCorner<3, 3>() = skew(xi.head<3>());
  matrix.topRightCorner<3, 1>() = xi.tail<3>();
  return matrix;
}

TEST(SE3, ExpEqualsTheMatrixExponential) {
  for (const auto& xi : twists()) {
    const Matrix4d expected = hat(xi).exp();
    EXPECT_LT((SE3::exp(xi).matrix() - expected).norm(), 1e-13) << xi.transpose();
  }
}

TEST(SE3, LogInvertsExp) {
  for (const auto& xi : twists()) {
    EXPECT_LT((SE3::exp(xi).log() - xi).norm(), 1e-12) << xi.transpose();
  }
}

TEST(SE3, ComposesAsMatricesDo) {
  const SE3 T_a = SE3::exp(twists()[20]);
  const SE3 T_b(SO3::exp({0.2, 0.9, -0.3}), {4, 5, 6});
  EXPECT_LT(((T_a * T_b).matrix() - T_a.matrix() * T_b.matrix()).norm(), 1e-13);
  EXPECT_LT((T_a.inverse().matrix() - T_a.matrix().inverse()).norm(), 1e-13);
  const Vector3d p(1, 2, 3);
  EXPECT_LT((T_a * p - (T_a.matrix() * p.homogeneous()).head<3>()).norm(), 1e-14);
  EXPECT_LT((SE3::from_matrix(T_b.matrix()).matrix() - T_b.matrix()).norm(), 1e-14);
}

TEST(SE3, TransformTakesCoordinatesFromTheRightFrameToTheLeft) {
  // A camera one metre up, looking along world x: what is 2 m ahead of it is at (2, 0, 1).
  Eigen::Matrix3d R_world_camera;
  R_world_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const SE3 T_world_camera(SO3::from_matrix(R_world_camera), {0, 0, 1});
  EXPECT_LT((T_world_camera * Vector3d(0, 0, 2) - Vector3d(2, 0, 1)).norm(), 1e-15);
}

TEST(SE3, AdjointMovesAPerturbationToTheLeft) {
  const SE3 T(SO3::exp({0.5, -0.7, 1.1}), {1, 2, -3});
  Vector6d xi;
  xi << 0.1, 0.2, -0.1, 0.3, 0.1, 0.5;
  const Matrix4d difference =
      (T * SE3::exp(xi)).matrix() - (SE3::exp(T.adjoint() * xi) * T).matrix();
  EXPECT_LT(difference.norm(), 1e-13);
}

TEST(SE3, JacobiansAgreeWithFiniteDifferences) {
  // Central differences of step 1e-6: truncation 1e-11, rounding 1e-9 for metres.
  constexpr double kStep = 1e-6;
  for (const auto& xi : twists()) {
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d d = kStep * Vector6d::Unit(axis);
      const Vector6d right = (SE3::exp(xi - d).inverse() * SE3::exp(xi + d)).log() / (2.0 * kStep);
      const Vector6d left = (SE3::exp(xi + d) * SE3::exp(xi - d).inverse()).log() / (2.0 * kStep);
      EXPECT_LT((SE3::right_jacobian(xi).col(axis) - right).norm(), 1e-8) << xi.transpose();
      EXPECT_LT((SE3::left_jacobian(xi).col(axis) - left).norm(), 1e-8) << xi.transpose();
    }
  }
}

TEST(SE3, JacobianInversesAreInverses) {
  for (const auto& xi : twists()) {
    const Matrix6d right = SE3::right_jacobian(xi) * SE3::right_jacobian_inverse(xi);
    const Matrix6d left = SE3::left_jacobian_inverse(xi) * SE3::left_jacobian(xi);
    EXPECT_LT((right - Matrix6d::Identity()).norm(), 1e-11) << xi.transpose();
    EXPECT_LT((left - Matrix6d::Identity()).norm(), 1e-11) << xi.transpose();
  }
}

TEST(SE3, LocalIsTheInverseOfRetract) {
  const SE3 T_a(SO3::exp({0.5, -0.7, 1.1}), {1, 2, -3});
  const SE3 T_b(SO3::exp({-0.5, 0.1, 0.4}), {0, 5, 1});
  EXPECT_LT((retract(T_a, local(T_a, T_b)).matrix() - T_b.matrix()).norm(), 1e-13);
  EXPECT_EQ(local(T_a, T_a).norm(), 0.0);
}

TEST(SE3, InterpolationIsConstantBodyVelocity) {
  // Half a circle of radius 2 m: halfway the interpolation is on the arc, where a linear
  // interpolation of the matrices (the paper's eq. 1) would be 2 m away, at the centre.
  const double pi = std::acos(-1.0);
  const SE3 T_start;
  const SE3 T_end(SO3::exp({0, 0, pi - 1e-9}), {0, 4, 0});
  const SE3 T_half = interpolate(T_start, T_end, 0.5);
  EXPECT_LT((T_half.translation() - Vector3d(2, 2, 0)).norm(), 1e-6);
  EXPECT_LT((interpolate(T_start, T_end, 0.0).matrix() - T_start.matrix()).norm(), 1e-15);
  EXPECT_LT((interpolate(T_start, T_end, 1.0).matrix() - T_end.matrix()).norm(), 1e-12);
}

TEST(SE3, RefusesWhatIsNoTransform) {
  Matrix4d T = Matrix4d::Identity();
  T(3, 0) = 0.1;
  EXPECT_THROW((void)SE3::from_matrix(T), std::logic_error);
}

}  // namespace
}  // namespace camvox::geometry
