#pragma once

#include "camvox/import/depth_registration.hpp"
#include "camvox/import/import_report.hpp"

namespace camvox::import {

struct SevenScenesOptions : ImportOptions {
  /// The Kinect of 7-Scenes: the depth camera sits 2.5 cm left of the colour camera.
  DepthRegistration rig = {.depth = {.fx_px = 585.0, .fy_px = 585.0},
                           .camera = {},
                           .p_camera_depth_m = {-0.025, 0.0, 0.0}};
  double frame_rate_hz = 30.0;
};

/// Imports a sequence of Microsoft 7-Scenes (Shotton et al., "Scene coordinate regression forests",
/// CVPR 2013): frame-NNNNNN.color.png or .jpg, .depth.png, .pose.txt.
///
/// | topic | from |
/// | --- | --- |
/// | /camera/image_raw/compressed | colour, the files as they are |
/// | /camera/camera_info | the options; 7-Scenes publishes no calibration |
/// | /camera/depth_registered/image_raw | depth in the colour camera, 16UC1 mm (`register_depth`) |
/// | /ground_truth/odometry | camera_optical_frame in `map`; the poses are the depth camera's |
/// | /tf_static | base_link (at the colour camera) -> camera_optical_frame ->
/// camera_depth_optical_frame |
///
/// 7-Scenes has no time stamps: frame i is at i / 30 s after 1970.
storage::Result<ImportReport> import_seven_scenes(const std::filesystem::path& folder,
                                                  const SevenScenesOptions& options);

}  // namespace camvox::import
