#pragma once

#include <string>
#include <vector>

#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox::bench {

/// Scenes to calibrate with, and what should come out.
struct BenchCase {
  std::string name;
  std::vector<calibration::Scene> scenes;
  sensors::CameraIntrinsics intrinsics;
  geometry::SE3 T_camera_lidar;  ///< Truth, or the reference of a data set.
};

/// How many stops there are in the synthetic worlds.
[[nodiscard]] std::size_t synthetic_count();
/// One of them; rendered once and kept in the build folder.
[[nodiscard]] BenchCase synthetic_case(std::size_t index);
/// Junctions, single frames and groups of ten frames of KITTI; none without the shared data.
[[nodiscard]] std::size_t real_count();
[[nodiscard]] BenchCase real_case(std::size_t index);

}  // namespace camvox::bench
