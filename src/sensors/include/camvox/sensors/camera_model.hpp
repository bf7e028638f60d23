#pragma once

#include <Eigen/Core>
#include <optional>

#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/distortion.hpp"

namespace camvox::sensors {

/// A pixel and how it moves with the point it shows.
struct Projection {
  Eigen::Vector2d u_px;
  Eigen::Matrix<double, 2, 3> J_point;  ///< d(u_px) / d(p_camera), px per metre.
};

/// The direction that a pixel looks in, with the evidence that the lens model could be inverted.
struct Unprojection {
  Eigen::Vector3d f_camera;  ///< Unit vector, z > 0.
  bool converged = false;    ///< False: f_camera does not project back onto the pixel.
  int iterations = 0;
  double residual_px = 0.0;  ///< Distance of the pixel to the projection of f_camera.
};

/// Maps points in the camera frame (z forward, x right, y down) to pixels and back, distortion
/// included. Immutable, so safe to use from many threads.
class CameraModel {
 public:
  /// Throws config::ConfigError with all problems of `intrinsics`.
  explicit CameraModel(const CameraIntrinsics& intrinsics);

  /// The pixel of a point; not clipped to the image (see contains). Nothing for a point behind
  /// the camera, outside the range in which the lens model is one to one, or NaN.
  [[nodiscard]] std::optional<Eigen::Vector2d> project(const Eigen::Vector3d& p_camera) const;
  [[nodiscard]] std::optional<Projection> project_with_jacobian(
      const Eigen::Vector3d& p_camera) const;

  /// Inverts the lens model by Newton's method to 1e-9 px, at most 50 steps.
  [[nodiscard]] Unprojection unproject(const Eigen::Vector2d& u_px) const;

  /// Whether a pixel lies in the image, at least `margin_px` from the border pixels' centres.
  [[nodiscard]] bool contains(const Eigen::Vector2d& u_px, double margin_px = 0.0) const;

  [[nodiscard]] const CameraIntrinsics& intrinsics() const { return intrinsics_; }

 private:
  [[nodiscard]] bool is_visible_direction(const Eigen::Vector3d& p_camera) const;

  CameraIntrinsics intrinsics_;
  Distortion distortion_;
  Eigen::Vector2d focal_px_;
  Eigen::Vector2d centre_px_;
};

}  // namespace camvox::sensors
