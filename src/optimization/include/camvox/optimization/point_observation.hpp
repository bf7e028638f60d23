#pragma once

#include <Eigen/Core>
#include <optional>

#include "camvox/geometry/se3.hpp"

namespace camvox::optimization {

/// What the third row of a residual compares when the feature has depth.
enum class DepthModel {
  kMetric,         ///< z in metres, weighted with its own sigma.
  kVirtualStereo,  ///< The paper's: column in a virtual right camera, u_R = u - fx * b / z,
                   ///< weighted with the pixel sigma. It hardly uses a far depth; for comparison.
};

/// The pinhole that undistorted pixels live on.
struct PinholeCamera {
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double virtual_baseline_m = 0.05;  ///< Of DepthModel::kVirtualStereo only.
};

/// One landmark seen in one frame.
struct PointObservation {
  Eigen::Vector2d u_px = Eigen::Vector2d::Zero();  ///< Undistorted.
  double sigma_px = 1.0;                           ///< Of each coordinate.
  double depth_m = 0.0;                            ///< z along the optical axis; 0: none.
  double sigma_depth_m = 0.0;                      ///< Of depth_m; positive when depth_m is.
};

/// Difference between prediction and observation in units of sigma, and how it moves.
struct PointResidual {
  int rows = 2;  ///< 2: pixel only; 3: pixel and depth. Further rows are zero.
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  /// d r / d xi for T_world_camera * exp(xi), xi = [rotation; translation].
  Eigen::Matrix<double, 3, 6> J_pose = Eigen::Matrix<double, 3, 6>::Zero();
  Eigen::Matrix3d J_point = Eigen::Matrix3d::Zero();  ///< d r / d p_world.

  [[nodiscard]] double squared_norm() const { return r.squaredNorm(); }
};

/// The residual of `observation` when the landmark is at `p_world` and the camera at
/// `T_world_camera`; nothing when the point is less than 1 cm in front of the camera, or NaN.
[[nodiscard]] std::optional<PointResidual> evaluate(const geometry::SE3& T_world_camera,
                                                    const Eigen::Vector3d& p_world,
                                                    const PointObservation& observation,
                                                    const PinholeCamera& camera,
                                                    DepthModel model);

}  // namespace camvox::optimization
