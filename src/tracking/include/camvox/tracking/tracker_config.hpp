#pragma once

#include <string>

#include "camvox/config/parameters.hpp"
#include "camvox/optimization/point_observation.hpp"
#include "camvox/tracking/keyframe_decision.hpp"
#include "camvox/tracking/local_map.hpp"

namespace camvox::tracking {

/// Tuning of Tracker. YAML keys are the field names.
struct TrackerConfig {
  std::string depth_model = "metric";  ///< Or virtual_stereo: the paper's, for comparison.
  double virtual_baseline_m = 0.05;    ///< Of virtual_stereo.
  double sigma_px = 1.0;               ///< Of a feature of octave 0; grows with the octave's scale.
  double close_depth_m = 130.0;        ///< Depth beyond founds no landmark.
  double max_depth_sigma_ratio = 0.1;  ///< Depth less certain than this share is not used.
  int min_features_with_depth = 100;   ///< The first keyframe needs so many.
  int min_inliers = 30;                ///< Fewer are no pose.
  int min_inliers_relocalised = 50;    ///< The same after the pose was lost.
  double motion_radius_px = 15.0;      ///< Search around the place that the motion predicts.
  double motion_radius_gyro_px = 6.0;  ///< The same when the gyro predicts the rotation.
  double map_radius_px = 7.5;          ///< Search for landmarks of the local map.
  double gyro_sigma_deg = 0.2;         ///< Of the rotation between two frames; 0: no prior.
  /// Of what carries the camera. A pose that would take more is refused; 0: none is.
  double max_acceleration_mps2 = 6.0;
  bool localisation_only = false;  ///< Make no keyframes: the map stays as it is.
  /// Wait for a map and a place in it instead of starting a map; localisation_only implies it.
  bool relocalise_at_start = false;
  int relocalisation_interval = 5;  ///< Frames between two requests while lost.
  KeyframeConfig keyframe;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("depth_model", self.depth_model, config::one_of({"metric", "virtual_stereo"}));
    field("virtual_baseline_m", self.virtual_baseline_m, config::greater_than(0.0));
    field("sigma_px", self.sigma_px, config::greater_than(0.0));
    field("close_depth_m", self.close_depth_m, config::greater_than(0.0));
    field("max_depth_sigma_ratio", self.max_depth_sigma_ratio, config::greater_than(0.0));
    field("min_features_with_depth", self.min_features_with_depth, config::at_least(10));
    field("min_inliers", self.min_inliers, config::at_least(10));
    field("min_inliers_relocalised", self.min_inliers_relocalised, config::at_least(10));
    field("motion_radius_px", self.motion_radius_px, config::greater_than(0.0));
    field("motion_radius_gyro_px", self.motion_radius_gyro_px, config::greater_than(0.0));
    field("map_radius_px", self.map_radius_px, config::greater_than(0.0));
    field("gyro_sigma_deg", self.gyro_sigma_deg, config::at_least(0.0));
    field("max_acceleration_mps2", self.max_acceleration_mps2, config::at_least(0.0));
    field("localisation_only", self.localisation_only);
    field("relocalise_at_start", self.relocalise_at_start);
    field("relocalisation_interval", self.relocalisation_interval, config::at_least(1));
    field("keyframe", self.keyframe);
  }
};

/// The camera as tracking sees it: undistorted pixels, and the image pyramid of the features.
struct TrackingCamera {
  optimization::PinholeCamera pinhole;
  int width_px = 0;
  int height_px = 0;
  ScaleLevels scale;
};

}  // namespace camvox::tracking
