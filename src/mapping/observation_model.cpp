#include "camvox/mapping/observation_model.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace camvox::mapping {

ObservationModel::ObservationModel(const MappingConfig& config,
                                   const tracking::TrackingCamera& camera)
    : config_(config),
      camera_(camera),
      depth_model_(config.depth_model == "virtual_stereo" ? optimization::DepthModel::kVirtualStereo
                                                          : optimization::DepthModel::kMetric) {
  config::require_valid(config, "mapping");
  const bool usable = camera.width_px > 0 && camera.height_px > 0 && camera.pinhole.fx_px > 0.0 &&
                      camera.pinhole.fy_px > 0.0 && camera.scale.levels > 0;
  if (!usable) throw std::logic_error("mapping: camera without size, focal length or scale levels");
  camera_.pinhole.virtual_baseline_m = config.virtual_baseline_m;
  for (int octave = 0; octave < 256; ++octave) {
    const int level = std::min(octave, camera.scale.levels - 1);
    scales_.push_back(std::pow(static_cast<double>(camera.scale.factor), level));
  }
}

std::optional<ObservationModel::Sight> ObservationModel::project(
    const geometry::SE3& T_map_camera, const Eigen::Vector3d& p_map) const {
  const Eigen::Vector3d p_camera =
      T_map_camera.rotation().inverse() * (p_map - T_map_camera.translation());
  if (!(p_camera.z() > 0.05)) return std::nullopt;
  const auto& pinhole = camera_.pinhole;
  const Eigen::Vector2d u_px(pinhole.fx_px * p_camera.x() / p_camera.z() + pinhole.cx_px,
                             pinhole.fy_px * p_camera.y() / p_camera.z() + pinhole.cy_px);
  const bool inside = u_px.x() >= 0.0 && u_px.y() >= 0.0 && u_px.x() <= camera_.width_px - 1.0 &&
                      u_px.y() <= camera_.height_px - 1.0;
  if (!inside) return std::nullopt;
  return Sight{u_px, p_camera.z(), p_camera.norm()};
}

std::optional<ObservationModel::Sight> ObservationModel::sees(
    const geometry::SE3& T_map_camera, const tracking::Landmark& landmark) const {
  const auto sight = project(T_map_camera, landmark.p_map);
  if (!sight) return std::nullopt;
  if (sight->distance_m < 0.8 * landmark.min_distance_m ||
      sight->distance_m > 1.2 * landmark.max_distance_m) {
    return std::nullopt;
  }
  const Eigen::Vector3d ray = landmark.p_map - T_map_camera.translation();
  if (ray.dot(landmark.f_map.cast<double>()) < 0.5 * sight->distance_m) return std::nullopt;
  return sight;
}

optimization::PointObservation ObservationModel::observation(
    const features::FrameFeatures& features, std::size_t feature) const {
  optimization::PointObservation result;
  result.u_px = features.undistorted_px[feature].cast<double>();
  result.sigma_px = sigma_px(features.key_points[feature].octave);
  const double depth_m = features.depth_m[feature];
  const double sigma_m = features.depth_sigma_m[feature];
  if (depth_m > 0.0 && sigma_m > 0.0 && sigma_m <= config_.max_depth_sigma_ratio * depth_m) {
    result.depth_m = depth_m;
    result.sigma_depth_m = sigma_m;
  }
  return result;
}

Eigen::Vector3d ObservationModel::bearing(const Eigen::Vector2d& u_px) const {
  const auto& pinhole = camera_.pinhole;
  return {
      (u_px.x() - pinhole.cx_px) / pinhole.fx_px, (u_px.y() - pinhole.cy_px) / pinhole.fy_px, 1.0};
}

double ObservationModel::depth_sigma_m(const optimization::PointObservation& observation) const {
  if (depth_model_ == optimization::DepthModel::kMetric) return observation.sigma_depth_m;
  // One pixel of the virtual disparity bf / z.
  const double bf = camera_.pinhole.fx_px * camera_.pinhole.virtual_baseline_m;
  return observation.sigma_px * observation.depth_m * observation.depth_m / bf;
}

}  // namespace camvox::mapping
