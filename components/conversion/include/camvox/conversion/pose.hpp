#pragma once

#include <array>

#include "camvox/geometry/se3.hpp"

namespace camvox::conversion {

/// A pose as the plain types hold it: [x y z qx qy qz qw].
using PoseArray = std::array<double, 7>;

[[nodiscard]] inline PoseArray to_array(const geometry::SE3& T) {
  const auto& t = T.translation();
  const auto& q = T.rotation().quaternion();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

/// Throws std::logic_error when the quaternion is not of unit norm (a message never filled, NaN).
[[nodiscard]] inline geometry::SE3 to_se3(const PoseArray& pose) {
  return {geometry::SO3(Eigen::Quaterniond(pose[6], pose[3], pose[4], pose[5])),
          Eigen::Vector3d(pose[0], pose[1], pose[2])};
}

/// A 6x6 covariance as the plain types hold it: row-major.
using CovarianceArray = std::array<double, 36>;

[[nodiscard]] inline CovarianceArray to_array(const geometry::Matrix6d& covariance) {
  CovarianceArray array{};
  Eigen::Map<Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(array.data()) = covariance;
  return array;
}

[[nodiscard]] inline geometry::Matrix6d to_matrix(const CovarianceArray& array) {
  return Eigen::Map<const Eigen::Matrix<double, 6, 6, Eigen::RowMajor>>(array.data());
}

}  // namespace camvox::conversion
