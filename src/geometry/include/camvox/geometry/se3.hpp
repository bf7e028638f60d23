#pragma once

#include <Eigen/Core>

#include "camvox/geometry/so3.hpp"

namespace camvox::geometry {

/// A tangent vector of SE(3): [rotation (rad); translation (m)].
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A rigid transform. `T_world_camera` takes coordinates in camera to coordinates in world:
///
///     p_world = T_world_camera * p_camera;
///     T_world_lidar = T_world_camera * T_camera_lidar;
///
/// Tangent vectors are [rotation; translation], perturbations stand on the right:
/// T * SE3::exp(delta), so delta is in the axes of the transform's right-hand frame. Formulas:
/// Barfoot, "State Estimation for Robotics" (2017), section 7.1, with the two blocks swapped.
class SE3 {
 public:
  /// The identity.
  SE3() : translation_(Eigen::Vector3d::Zero()) {}
  SE3(const SO3& rotation, const Eigen::Vector3d& translation)
      : rotation_(rotation), translation_(translation) {}

  /// From a homogeneous matrix. Throws std::logic_error when its upper left is not a rotation or
  /// its last row not 0 0 0 1.
  [[nodiscard]] static SE3 from_matrix(const Eigen::Matrix4d& T);

  /// The motion at constant body velocity `xi` for one unit of time (a screw).
  [[nodiscard]] static SE3 exp(const Vector6d& xi);
  /// The inverse of exp with the rotation part at most pi long.
  [[nodiscard]] Vector6d log() const;

  [[nodiscard]] SE3 inverse() const {
    const SO3 R = rotation_.inverse();
    return {R, -(R * translation_)};
  }
  [[nodiscard]] SE3 operator*(const SE3& other) const {
    return {rotation_ * other.rotation_, rotation_ * other.translation_ + translation_};
  }
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point) const {
    return rotation_ * point + translation_;
  }

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return translation_; }
  [[nodiscard]] Eigen::Matrix4d matrix() const;

  /// The matrix with T * exp(xi) = exp(Ad * xi) * T. It takes a twist or a perturbation from the
  /// right-hand frame to the left-hand one; a covariance C goes over as Ad C Ad^T.
  [[nodiscard]] Matrix6d adjoint() const;

  /// Jr of exp(xi + d) = exp(xi) * exp(Jr d), for small d.
  [[nodiscard]] static Matrix6d right_jacobian(const Vector6d& xi);
  /// Jl of exp(xi + d) = exp(Jl d) * exp(xi), for small d.
  [[nodiscard]] static Matrix6d left_jacobian(const Vector6d& xi);
  /// Inverse of right_jacobian; valid for rotations below 2 pi.
  [[nodiscard]] static Matrix6d right_jacobian_inverse(const Vector6d& xi);
  /// Inverse of left_jacobian; valid for rotations below 2 pi.
  [[nodiscard]] static Matrix6d left_jacobian_inverse(const Vector6d& xi);

 private:
  SO3 rotation_;
  Eigen::Vector3d translation_;
};

/// `T` moved by the perturbation `xi`: T * exp(xi).
[[nodiscard]] inline SE3 retract(const SE3& T, const Vector6d& xi) { return T * SE3::exp(xi); }

/// The perturbation that takes `T_from` to `T_to`: retract(T_from, local(T_from, T_to)) = T_to.
[[nodiscard]] inline Vector6d local(const SE3& T_from, const SE3& T_to) {
  return (T_from.inverse() * T_to).log();
}

/// The transform a fraction `ratio` of the way from `T_a` (0) to `T_b` (1) at constant body
/// velocity: the motion model of a deskew. Ratios outside [0, 1] extrapolate.
[[nodiscard]] SE3 interpolate(const SE3& T_a, const SE3& T_b, double ratio);

}  // namespace camvox::geometry
