#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/mapping/map.hpp"
#include "camvox/mapping/mapping_config.hpp"
#include "camvox/optimization/point_observation.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::mapping {

/// How the camera sees landmarks, and how well: what the stages of mapping share.
class ObservationModel {
 public:
  /// Throws config::ConfigError with all problems of `config`, std::logic_error when the camera
  /// has no size or no focal length.
  ObservationModel(const MappingConfig& config, const tracking::TrackingCamera& camera);

  /// A landmark's place in a camera.
  struct Sight {
    Eigen::Vector2d u_px;
    double depth_m = 0.0;     ///< z.
    double distance_m = 0.0;  ///< Along the ray.
  };
  /// Where a point is seen; nothing when it is behind the camera or outside of the image.
  [[nodiscard]] std::optional<Sight> project(const geometry::SE3& T_map_camera,
                                             const Eigen::Vector3d& p_map) const;
  /// The same, and it must be within reach: seen from less than 60 degrees off its mean view, and
  /// in the range of distances in which its patch can be found.
  [[nodiscard]] std::optional<Sight> sees(const geometry::SE3& T_map_camera,
                                          const tracking::Landmark& landmark) const;

  /// Feature `feature` as bundle adjustment takes it; without depth when that is too uncertain.
  [[nodiscard]] optimization::PointObservation observation(const features::FrameFeatures& features,
                                                           std::size_t feature) const;
  /// Direction of a pixel in camera axes with z = 1.
  [[nodiscard]] Eigen::Vector3d bearing(const Eigen::Vector2d& u_px) const;
  /// Standard deviation of a depth under the depth model in use.
  [[nodiscard]] double depth_sigma_m(const optimization::PointObservation& observation) const;

  /// Size of a patch of an octave in pixels of octave 0.
  [[nodiscard]] double scale(int octave) const { return scales_[static_cast<std::size_t>(octave)]; }
  [[nodiscard]] double sigma_px(int octave) const { return config_.sigma_px * scale(octave); }
  [[nodiscard]] const tracking::TrackingCamera& camera() const { return camera_; }
  [[nodiscard]] const MappingConfig& config() const { return config_; }
  [[nodiscard]] optimization::DepthModel depth_model() const { return depth_model_; }

 private:
  MappingConfig config_;
  tracking::TrackingCamera camera_;
  optimization::DepthModel depth_model_;
  std::vector<double> scales_;  ///< 256 entries: any octave byte has one.
};

}  // namespace camvox::mapping
