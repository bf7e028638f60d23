#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace camvox::geometry {

/// The matrix of a cross product: skew(a) * b = a x b.
[[nodiscard]] inline Eigen::Matrix3d skew(const Eigen::Vector3d& a) {
  Eigen::Matrix3d matrix;
  matrix << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return matrix;
}

/// A rotation in 3D. `R_world_camera` takes a vector in camera axes to world axes.
///
/// Stored as a unit quaternion, so that log() is accurate for every angle, those near pi
/// included. A tangent vector is the rotation vector (axis times angle, rad), and perturbations
/// stand on the right: R * SO3::exp(delta). Source of all formulas: Barfoot, "State Estimation
/// for Robotics" (2017), section 7.1; Sola et al., "A micro Lie theory" (2018).
class SO3 {
 public:
  /// The identity.
  SO3() : q_(Eigen::Quaterniond::Identity()) {}

  /// Normalises `q`. Throws std::logic_error when its norm is not within 1e-3 of one (a
  /// quaternion that far off is not a rounding error but a mistake), or NaN.
  explicit SO3(const Eigen::Quaterniond& q);

  /// From a rotation matrix; takes out rounding errors. Throws std::logic_error when `R` is not a
  /// rotation to 1e-3 (a reflection, a scaled matrix, NaN).
  [[nodiscard]] static SO3 from_matrix(const Eigen::Matrix3d& R);

  /// The rotation by |w| rad around the axis w / |w|.
  [[nodiscard]] static SO3 exp(const Eigen::Vector3d& w);

  /// The shortest rotation vector, |w| <= pi. At exactly pi either sign of the axis is right.
  [[nodiscard]] Eigen::Vector3d log() const;

  /// The angle of the rotation in [0, pi].
  [[nodiscard]] double angle_rad() const;

  [[nodiscard]] SO3 inverse() const { return SO3(q_.conjugate(), Unchecked{}); }
  [[nodiscard]] SO3 operator*(const SO3& other) const;
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& vector) const {
    return q_._transformVector(vector);
  }

  [[nodiscard]] Eigen::Matrix3d matrix() const { return q_.toRotationMatrix(); }
  /// The unit quaternion; its sign carries no meaning.
  [[nodiscard]] const Eigen::Quaterniond& quaternion() const { return q_; }

  /// The matrix with R * exp(w) = exp(Ad * w) * R; for SO(3) it is the rotation matrix.
  [[nodiscard]] Eigen::Matrix3d adjoint() const { return matrix(); }

  /// Jr of exp(w + d) = exp(w) * exp(Jr d), for small d.
  [[nodiscard]] static Eigen::Matrix3d right_jacobian(const Eigen::Vector3d& w);
  /// Jl of exp(w + d) = exp(Jl d) * exp(w), for small d. Also exp's translation part in SE3.
  [[nodiscard]] static Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& w);
  /// Inverse of right_jacobian, closed form; valid for |w| < 2 pi.
  [[nodiscard]] static Eigen::Matrix3d right_jacobian_inverse(const Eigen::Vector3d& w);
  /// Inverse of left_jacobian, closed form; valid for |w| < 2 pi.
  [[nodiscard]] static Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& w);

 private:
  struct Unchecked {};
  SO3(const Eigen::Quaterniond& q, Unchecked) : q_(q) {}

  Eigen::Quaterniond q_;
};

/// The rotation a fraction `ratio` of the way from `R_a` (0) to `R_b` (1) along the geodesic, at
/// constant rate. Ratios outside [0, 1] extrapolate.
[[nodiscard]] SO3 interpolate(const SO3& R_a, const SO3& R_b, double ratio);

}  // namespace camvox::geometry
