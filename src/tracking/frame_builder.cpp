#include "camvox/tracking/frame_builder.hpp"

#include <stdexcept>

namespace camvox::tracking {

FrameBuilder::FrameBuilder(const FrameBuilderConfig& config,
                           const sensors::CameraIntrinsics& intrinsics)
    : config_(config), camera_(intrinsics), extractor_(config.extractor), undistorter_(camera_) {
  config::require_valid(config, "frame_builder");
}

features::FrameFeatures FrameBuilder::build(const features::ImageView& image,
                                            const depth::DepthView& depth) {
  const bool has_depth = depth.width_px > 0 && depth.depth_m != nullptr;
  if (has_depth && (depth.width_px != image.width_px || depth.height_px != image.height_px)) {
    throw std::logic_error("FrameBuilder: depth image and image differ in size");
  }
  features::FrameFeatures features = extractor_.extract(image);
  undistorter_.undistort(features);
  features.depth_m.assign(features.size(), 0.0F);
  features.depth_sigma_m.assign(features.size(), 0.0F);
  for (std::size_t i = 0; has_depth && i < features.size(); ++i) {
    const auto& point = features.key_points[i];
    const auto sample = depth::sample_depth(depth, point.u_px, point.v_px, config_.depth_radius_px);
    features.depth_m[i] = sample.depth_m;
    features.depth_sigma_m[i] = sample.sigma_m;
  }
  return features;
}

TrackingCamera FrameBuilder::tracking_camera() const {
  const auto& intrinsics = camera_.intrinsics();
  TrackingCamera camera;
  camera.pinhole.fx_px = intrinsics.fx_px;
  camera.pinhole.fy_px = intrinsics.fy_px;
  camera.pinhole.cx_px = intrinsics.cx_px;
  camera.pinhole.cy_px = intrinsics.cy_px;
  camera.width_px = intrinsics.width_px;
  camera.height_px = intrinsics.height_px;
  camera.scale.factor = static_cast<float>(config_.extractor.scale_factor);
  camera.scale.levels = config_.extractor.levels;
  return camera;
}

}  // namespace camvox::tracking
