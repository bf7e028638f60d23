#include "kitti_calibration.hpp"

#include <fmt/format.h>

#include "import_error.hpp"
#include "text_file.hpp"

namespace camvox::import {
namespace {

namespace fs = std::filesystem;
using RowMajor3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// Numbers of a key in a file, as many as the key must have.
class Values {
 public:
  explicit Values(const fs::path& path) : path_(path), values_(read_kitti_values(path)) {}

  [[nodiscard]] const std::vector<double>& of(const std::string& key, std::size_t count) const {
    const auto found = values_.find(key);
    if (found == values_.end()) fail_corrupt(path_, "has no " + key);
    if (found->second.size() != count) {
      fail_corrupt(path_,
                   fmt::format("{} has {} numbers, not {}", key, found->second.size(), count));
    }
    return found->second;
  }

  /// The nearest rotation: the files have seven digits.
  [[nodiscard]] Eigen::Matrix3d rotation(const std::string& key) const {
    const Eigen::Matrix3d matrix = RowMajor3::Map(of(key, 9).data());
    if ((matrix * matrix.transpose() - Eigen::Matrix3d::Identity()).norm() > 1e-3 ||
        matrix.determinant() < 0.0) {
      fail_corrupt(path_, key + " is no rotation");
    }
    return Eigen::Quaterniond(matrix).normalized().toRotationMatrix();
  }

  [[nodiscard]] Eigen::Isometry3d transform() const {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.linear() = rotation("R");
    T.translation() = Eigen::Vector3d::Map(of("T", 3).data());
    return T;
  }

 private:
  fs::path path_;
  KittiValues values_;
};

CameraModel rectified_camera(const Values& values, const std::string& number) {
  const auto& p = values.of("P_rect_" + number, 12);
  const auto& size = values.of("S_rect_" + number, 2);
  CameraModel camera;
  camera.width_px = static_cast<int>(size[0]);
  camera.height_px = static_cast<int>(size[1]);
  camera.fx_px = p[0];
  camera.fy_px = p[5];
  camera.cx_px = p[2];
  camera.cy_px = p[6];
  return camera;
}

/// From the unrectified reference camera 0 to the rectified camera: P_rect = K [I | t], so the
/// rectified camera sees R_rect_00 * p + t (IJRR paper, eq. 3 to 7).
Eigen::Isometry3d T_camera_reference(const Values& values, const std::string& number) {
  using Projection = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  const Eigen::Matrix<double, 3, 4> p = Projection::Map(values.of("P_rect_" + number, 12).data());
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() = values.rotation("R_rect_00");
  T.translation() = p.leftCols<3>().inverse() * p.col(3);
  return T;
}

bool there(const fs::path& path, const char* without, ImportReport& report) {
  if (fs::exists(path)) return true;
  report.missing.push_back(path.filename().string() + ": no " + without);
  return false;
}

}  // namespace

KittiValues read_kitti_values(const fs::path& path) {
  TextFile file(path);
  KittiValues values;
  while (file.next()) {
    if (file.empty_line()) continue;
    std::string key(file.fields()[0]);
    if (!key.ends_with(':') || key.size() == 1) file.fail("expected 'name: numbers'");
    key.pop_back();
    if (key == "calib_time") continue;
    values[key] = file.numbers(1, file.fields().size() - 1);
  }
  return values;
}

KittiCalibration read_kitti_calibration(const fs::path& folder, int camera, ImportReport& report) {
  KittiCalibration calibration;
  const auto number = fmt::format("{:02}", camera);
  std::optional<Eigen::Isometry3d> T_camera_reference0;
  if (const auto path = folder / "calib_cam_to_cam.txt";
      there(path, "camera_info, no camera in /tf_static", report)) {
    const Values values(path);
    calibration.camera = rectified_camera(values, number);
    T_camera_reference0 = T_camera_reference(values, number);
  }
  if (const auto path = folder / "calib_velo_to_cam.txt";
      there(path, "camera in /tf_static", report) && T_camera_reference0) {
    calibration.T_lidar_camera = (*T_camera_reference0 * Values(path).transform()).inverse();
  }
  if (const auto path = folder / "calib_imu_to_velo.txt";
      there(path, "velodyne in /tf_static", report)) {
    calibration.T_imu_lidar = Values(path).transform().inverse();
  }
  return calibration;
}

}  // namespace camvox::import
