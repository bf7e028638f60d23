#pragma once

#include <cstdint>

#include "camvox/depth/sample_depth.hpp"
#include "camvox/features/feature_extractor.hpp"
#include "camvox/features/undistorter.hpp"
#include "camvox/sensors/camera_model.hpp"
#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::tracking {

/// How images become frames. YAML keys are the field names.
struct FrameBuilderConfig {
  features::ExtractorConfig extractor;
  int depth_radius_px = 2;  ///< Depth is looked up so far around a feature.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("extractor", self.extractor);
    field("depth_radius_px", self.depth_radius_px, config::at_least(0), config::at_most(8));
  }
};

/// Makes frames of images and depth images: finds the features, moves them to where a pinhole
/// camera would see them, and looks their depth up at the pixel where they are seen. Keeps memory
/// between frames; one object per thread.
class FrameBuilder {
 public:
  /// Throws config::ConfigError with all problems of `config` and of the camera.
  FrameBuilder(const FrameBuilderConfig& config, const sensors::CameraIntrinsics& intrinsics);

  /// `depth` may be empty (no pixels): then no feature has depth. Otherwise it must have the size
  /// of the image. Neither is copied.
  [[nodiscard]] features::FrameFeatures build(const features::ImageView& image,
                                              const depth::DepthView& depth);

  /// What Tracker needs to know of the camera.
  [[nodiscard]] TrackingCamera tracking_camera() const;

 private:
  FrameBuilderConfig config_;
  sensors::CameraModel camera_;
  features::FeatureExtractor extractor_;
  features::Undistorter undistorter_;
};

}  // namespace camvox::tracking
