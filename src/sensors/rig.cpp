#include "camvox/sensors/rig.hpp"

#include <cmath>
#include <utility>

namespace camvox::sensors {
namespace {

using config::Problem;

/// Collects the problems of a rig, each with the key it is about.
struct Checker {
  std::string origin;
  std::vector<Problem> problems;

  void require_size(const std::string& key, const std::vector<double>& values, std::size_t size) {
    if (values.size() == size) return;
    problems.push_back(
        {{origin, 0},
         key,
         "expected " + std::to_string(size) + " numbers, got " + std::to_string(values.size())});
  }

  void require_transform(const std::string& key, const TransformConfig& transform) {
    require_size(key + ".translation_m", transform.translation_m, 3);
    require_size(key + ".rotation_xyzw", transform.rotation_xyzw, 4);
    double norm2 = 0.0;
    for (const double value : transform.rotation_xyzw) norm2 += value * value;
    if (transform.rotation_xyzw.size() == 4 && !(std::abs(norm2 - 1.0) < 1e-3)) {
      problems.push_back({{origin, 0},
                          key + ".rotation_xyzw",
                          config::to_yaml(transform.rotation_xyzw) + " must have norm 1"});
    }
  }
};

geometry::SE3 to_transform(const TransformConfig& transform) {
  const auto& t = transform.translation_m;
  const auto& q = transform.rotation_xyzw;
  return {geometry::SO3(Eigen::Quaterniond(q[3], q[0], q[1], q[2])), {t[0], t[1], t[2]}};
}

TransformConfig to_config(const geometry::SE3& T) {
  const auto& t = T.translation();
  const auto& q = T.rotation().quaternion();
  return {{t.x(), t.y(), t.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace

std::vector<Problem> check(const RigConfig& rig, const std::string& origin) {
  Checker checker{origin, config::check(rig, origin)};
  checker.require_transform("T_body_camera", rig.T_body_camera);
  checker.require_transform("T_lidar_camera", rig.T_lidar_camera);
  checker.require_transform("T_imu_lidar", rig.T_imu_lidar);
  checker.require_size("p_body_gnss_m", rig.p_body_gnss_m, 3);
  return checker.problems;
}

RigCalibration make_rig_calibration(const RigConfig& rig) {
  if (auto problems = check(rig); !problems.empty()) {
    throw config::ConfigError(std::move(problems));
  }
  const auto& antenna = rig.p_body_gnss_m;
  return {to_transform(rig.T_body_camera),
          to_transform(rig.T_lidar_camera),
          to_transform(rig.T_imu_lidar),
          {antenna[0], antenna[1], antenna[2]},
          rig.camera_time_offset_ns,
          rig.imu_time_offset_ns};
}

RigConfig to_config(const RigCalibration& rig) {
  return {to_config(rig.T_body_camera),
          to_config(rig.T_lidar_camera),
          to_config(rig.T_imu_lidar),
          {rig.p_body_gnss.x(), rig.p_body_gnss.y(), rig.p_body_gnss.z()},
          rig.camera_time_offset_ns,
          rig.imu_time_offset_ns};
}

}  // namespace camvox::sensors
