#include "camvox/optimization/point_observation.hpp"

namespace camvox::optimization {
namespace {

constexpr double kMinDepth_m = 0.01;

}  // namespace

std::optional<PointResidual> evaluate(const geometry::SE3& T_world_camera,
                                      const Eigen::Vector3d& p_world,
                                      const PointObservation& observation,
                                      const PinholeCamera& camera,
                                      DepthModel model) {
  const Eigen::Matrix3d R_camera_world = T_world_camera.rotation().matrix().transpose();
  const Eigen::Vector3d p_camera = R_camera_world * (p_world - T_world_camera.translation());
  if (!(p_camera.z() > kMinDepth_m)) return std::nullopt;

  const double inverse_z = 1.0 / p_camera.z();
  const double x = p_camera.x() * inverse_z;
  const double y = p_camera.y() * inverse_z;
  const double weight = 1.0 / observation.sigma_px;
  const double u_px = camera.fx_px * x + camera.cx_px;

  PointResidual result;
  result.r[0] = weight * (u_px - observation.u_px.x());
  result.r[1] = weight * (camera.fy_px * y + camera.cy_px - observation.u_px.y());
  Eigen::Matrix3d J_camera;  // d r / d p_camera
  J_camera.row(0) << weight * camera.fx_px * inverse_z, 0.0, -weight * camera.fx_px * x * inverse_z;
  J_camera.row(1) << 0.0, weight * camera.fy_px * inverse_z, -weight * camera.fy_px * y * inverse_z;
  J_camera.row(2).setZero();

  if (observation.depth_m > 0.0) {
    result.rows = 3;
    if (model == DepthModel::kMetric) {
      const double depth_weight = 1.0 / observation.sigma_depth_m;
      result.r[2] = depth_weight * (p_camera.z() - observation.depth_m);
      J_camera(2, 2) = depth_weight;
    } else {
      const double bf = camera.fx_px * camera.virtual_baseline_m;
      const double u_right_px = observation.u_px.x() - bf / observation.depth_m;
      result.r[2] = weight * (u_px - bf * inverse_z - u_right_px);
      J_camera.row(2) = J_camera.row(0);
      J_camera(2, 2) += weight * bf * inverse_z * inverse_z;
    }
  }
  // p_camera moves by [p_camera]x rotation - translation under a right perturbation.
  result.J_pose.leftCols<3>() = J_camera * geometry::skew(p_camera);
  result.J_pose.rightCols<3>() = -J_camera;
  result.J_point = J_camera * R_camera_world;
  return result;
}

}  // namespace camvox::optimization
