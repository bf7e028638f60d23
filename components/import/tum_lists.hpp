#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "camvox/import/import_report.hpp"

namespace camvox::import {

/// A file of a list with its time.
struct TumFile {
  std::int64_t stamp_ns = 0;
  std::filesystem::path file;
};

struct TumPose {
  std::int64_t stamp_ns = 0;
  Eigen::Isometry3d T_map_camera = Eigen::Isometry3d::Identity();
};

struct TumAcceleration {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
};

/// All lists of a sequence; what is missing is reported.
struct TumLists {
  std::vector<TumFile> color;
  std::vector<TumFile> depth;
  std::vector<TumPose> poses;
  std::vector<TumAcceleration> accelerations;
};
[[nodiscard]] TumLists read_tum_lists(const std::filesystem::path& folder,
                                      double index_rate_hz,
                                      ImportReport& report);

}  // namespace camvox::import
