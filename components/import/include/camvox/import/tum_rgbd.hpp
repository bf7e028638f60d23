#pragma once

#include <array>
#include <optional>

#include "camvox/import/import_report.hpp"

namespace camvox::import {

struct TumRgbdOptions : ImportOptions {
  /// fx, fy, cx, cy in pixels, and the plumb-bob distortion k1 k2 p1 p2 k3. None: those of the
  /// camera that the name of the folder tells (`tum_intrinsics`).
  std::optional<std::array<double, 9>> intrinsics;
  double depth_units_per_m = 5000.0;  ///< At least 1000; TUM and ICL-NUIM: 5000.
  double index_rate_hz = 30.0;        ///< Frames a second where the files have numbers, not times.
};

/// Imports a sequence of the TUM RGB-D benchmark (Sturm et al., "A benchmark for the evaluation of
/// RGB-D SLAM systems", IROS 2012), or of ICL-NUIM (Handa et al., ICRA 2014) in TUM's form.
///
/// | topic | from |
/// | --- | --- |
/// | /camera/image_raw/compressed | rgb.txt: the files as they are |
/// | /camera/camera_info | intrinsics, with the stamp of each image |
/// | /camera/depth_registered/image_raw | depth.txt: 16UC1, millimetres (rounded from 0.2 mm) |
/// | /ground_truth/odometry | groundtruth.txt: camera_optical_frame in `map` |
/// | /imu/data_raw | accelerometer.txt: acceleration only, the rest marked absent (REP-145) |
/// | /tf_static | base_link (at the camera) -> camera_optical_frame |
///
/// ICL-NUIM has associations.txt in place of rgb.txt and depth.txt, and *.gt.freiburg: numbers of
/// frames, which become times by `index_rate_hz`.
storage::Result<ImportReport> import_tum_rgbd(const std::filesystem::path& folder,
                                              const TumRgbdOptions& options);

/// Intrinsics by a camera's name, or by a folder's that has it in it: "freiburg1" or "fr1", to 3,
/// "icl" or "living_room" or "office"; none if it tells no camera.
[[nodiscard]] std::optional<std::array<double, 9>> tum_intrinsics(const std::string& name);

}  // namespace camvox::import
