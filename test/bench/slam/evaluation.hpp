#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::bench {

/// Absolute trajectory error after alignment in the least-squares sense (Umeyama, 1991).
struct AbsoluteError {
  double rmse_m = 0.0;
  double max_m = 0.0;
  double scale = 1.0;  ///< That the estimate would have to be multiplied with.
  double rmse_scaled_m = 0.0;
};

inline AbsoluteError absolute_error(const std::vector<geometry::SE3>& estimate,
                                    const std::vector<geometry::SE3>& truth) {
  AbsoluteError error;
  if (estimate.size() < 3) return error;
  Eigen::Matrix3Xd from(3, static_cast<Eigen::Index>(estimate.size()));
  Eigen::Matrix3Xd to(3, from.cols());
  for (Eigen::Index i = 0; i < from.cols(); ++i) {
    from.col(i) = estimate[static_cast<std::size_t>(i)].translation();
    to.col(i) = truth[static_cast<std::size_t>(i)].translation();
  }
  const auto errors = [&](const Eigen::Matrix4d& T) {
    const Eigen::Matrix3Xd moved =
        (T.topLeftCorner<3, 3>() * from).colwise() + Eigen::Vector3d(T.topRightCorner<3, 1>());
    return Eigen::VectorXd((moved - to).colwise().norm().transpose());
  };
  const Eigen::Matrix4d rigid = Eigen::umeyama(from, to, false);
  const Eigen::Matrix4d similar = Eigen::umeyama(from, to, true);
  const auto count = static_cast<double>(from.cols());
  error.rmse_m = std::sqrt(errors(rigid).squaredNorm() / count);
  error.max_m = errors(rigid).maxCoeff();
  error.rmse_scaled_m = std::sqrt(errors(similar).squaredNorm() / count);
  error.scale = std::cbrt(similar.topLeftCorner<3, 3>().determinant());
  return error;
}

/// The value below which a share of the values lies.
inline double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto place = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(
      values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
  return values[place];
}

}  // namespace camvox::bench
