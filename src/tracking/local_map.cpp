#include "camvox/tracking/local_map.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::tracking {

DistanceRange distance_range(float distance_m, int octave, const ScaleLevels& scale) {
  const float max_m = distance_m * std::pow(scale.factor, static_cast<float>(octave));
  return {max_m / std::pow(scale.factor, static_cast<float>(scale.levels - 1)), max_m};
}

int predicted_octave(float distance_m, float max_distance_m, const ScaleLevels& scale) {
  const float octave = std::log(max_distance_m / distance_m) / std::log(scale.factor);
  return std::clamp(static_cast<int>(std::lround(octave)), 0, scale.levels - 1);
}

std::optional<Landmark> landmark_from_depth(const Keyframe& keyframe,
                                            std::size_t feature,
                                            const optimization::PinholeCamera& camera,
                                            const ScaleLevels& scale) {
  const auto& features = keyframe.features;
  const double depth_m = features.depth_m[feature];
  if (!(depth_m > 0.0)) return std::nullopt;
  const Eigen::Vector2d u_px = features.undistorted_px[feature].cast<double>();
  const Eigen::Vector3d p_camera((u_px.x() - camera.cx_px) / camera.fx_px * depth_m,
                                 (u_px.y() - camera.cy_px) / camera.fy_px * depth_m,
                                 depth_m);
  const auto range = distance_range(
      static_cast<float>(p_camera.norm()), features.key_points[feature].octave, scale);
  Landmark landmark;
  landmark.id = landmark_id(keyframe.id, feature);
  landmark.p_map = keyframe.T_map_camera * p_camera;
  landmark.f_map = (keyframe.T_map_camera.rotation() * p_camera.normalized()).cast<float>();
  landmark.min_distance_m = range.min_m;
  landmark.max_distance_m = range.max_m;
  landmark.sigma_m = features.depth_sigma_m[feature];
  landmark.descriptor = features.descriptors[feature];
  return landmark;
}

}  // namespace camvox::tracking
