#include "camvox/sensors/camera_model.hpp"

#include <Eigen/LU>
#include <cmath>
#include <utility>

namespace camvox::sensors {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const CameraIntrinsics& checked(const CameraIntrinsics& intrinsics) {
  if (auto problems = check(intrinsics); !problems.empty()) {
    throw config::ConfigError(std::move(problems));
  }
  return intrinsics;
}

}  // namespace

CameraModel::CameraModel(const CameraIntrinsics& intrinsics)
    : intrinsics_(checked(intrinsics)),
      distortion_(intrinsics.distortion_model, intrinsics.distortion),
      focal_px_(intrinsics.fx_px, intrinsics.fy_px),
      centre_px_(intrinsics.cx_px, intrinsics.cy_px) {}

bool CameraModel::is_visible_direction(const Vector3d& p_camera) const {
  // Written so that NaN is not visible. One micrometre: nearer points have no direction.
  return p_camera.z() > 1e-6 && p_camera.head<2>().norm() < distortion_.max_radius() * p_camera.z();
}

std::optional<Vector2d> CameraModel::project(const Vector3d& p_camera) const {
  if (!is_visible_direction(p_camera)) return std::nullopt;
  const Vector2d xy = p_camera.head<2>() / p_camera.z();
  return focal_px_.cwiseProduct(distortion_.apply(xy)) + centre_px_;
}

std::optional<Projection> CameraModel::project_with_jacobian(const Vector3d& p_camera) const {
  if (!is_visible_direction(p_camera)) return std::nullopt;
  const double inverse_z = 1.0 / p_camera.z();
  const Vector2d xy = p_camera.head<2>() / p_camera.z();
  const Distortion::Result distorted = distortion_.apply_with_jacobian(xy);
  Eigen::Matrix<double, 2, 3> J_normalised;
  J_normalised << inverse_z, 0.0, -xy.x() * inverse_z, 0.0, inverse_z, -xy.y() * inverse_z;
  return Projection{focal_px_.cwiseProduct(distorted.xy_distorted) + centre_px_,
                    focal_px_.asDiagonal() * distorted.J_xy * J_normalised};
}

Unprojection CameraModel::unproject(const Vector2d& u_px) const {
  constexpr int kMaxIterations = 50;
  constexpr double kTolerance_px = 1e-9;
  const Vector2d target = (u_px - centre_px_).cwiseQuotient(focal_px_);
  Vector2d xy = target;
  Unprojection result;
  for (;; ++result.iterations) {
    const Distortion::Result distorted = distortion_.apply_with_jacobian(xy);
    const Vector2d error = target - distorted.xy_distorted;
    result.residual_px = error.cwiseProduct(focal_px_).norm();
    if (!(result.residual_px > kTolerance_px) || result.iterations == kMaxIterations) break;
    // A full step may leap over the fold of a strong distortion: never more than half the
    // present radius plus a little.
    Vector2d step = distorted.J_xy.inverse() * error;
    const double longest = 0.5 * xy.norm() + 0.1;
    if (step.norm() > longest) step *= longest / step.norm();
    xy += step;
  }
  result.converged = result.residual_px <= kTolerance_px && xy.norm() < distortion_.max_radius();
  result.f_camera = Vector3d(xy.x(), xy.y(), 1.0).normalized();
  return result;
}

bool CameraModel::contains(const Vector2d& u_px, double margin_px) const {
  return u_px.x() >= margin_px && u_px.x() <= intrinsics_.width_px - 1 - margin_px &&
         u_px.y() >= margin_px && u_px.y() <= intrinsics_.height_px - 1 - margin_px;
}

}  // namespace camvox::sensors
