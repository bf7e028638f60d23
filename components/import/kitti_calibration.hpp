#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "camvox/import/import_report.hpp"
#include "messages.hpp"

namespace camvox::import {

/// A calibration file of KITTI: lines of "name: numbers". Lines with words (dates) are kept out.
using KittiValues = std::map<std::string, std::vector<double>>;
[[nodiscard]] KittiValues read_kitti_values(const std::filesystem::path& path);

/// What the three files say about the rectified camera and where it is; what a missing file would
/// have said is not there, and is reported as missing.
struct KittiCalibration {
  std::optional<CameraModel> camera;
  std::optional<Eigen::Isometry3d> T_imu_lidar;
  std::optional<Eigen::Isometry3d> T_lidar_camera;
};
[[nodiscard]] KittiCalibration read_kitti_calibration(const std::filesystem::path& folder,
                                                      int camera,
                                                      ImportReport& report);

}  // namespace camvox::import
