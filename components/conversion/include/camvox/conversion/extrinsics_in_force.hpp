#pragma once

#include <cstdint>

#include "camvox/geometry/se3.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox::conversion {

/// Where lidar and camera sit to each other: what the rig file says, until a calibration says
/// better. All components that turn between the two take it over in this way. The IMU sits on the
/// lidar and moves with it.
class ExtrinsicsInForce {
 public:
  using Extrinsics = camvox_interfaces::msg::Extrinsics;

  explicit ExtrinsicsInForce(const sensors::RigCalibration& rig)
      : T_camera_lidar_(rig.T_camera_lidar()), T_lidar_imu_(rig.T_imu_lidar.inverse()) {}

  /// Takes over what passed its gate and is newer, and says whether it was. Newer by version or by
  /// stamp: a calibration that was restarted counts from one again, and one whose clock was set
  /// back counts on. Throws std::logic_error for a transform that is none.
  [[nodiscard]] bool take(const Extrinsics& extrinsics);

  [[nodiscard]] const geometry::SE3& T_camera_lidar() const { return T_camera_lidar_; }
  [[nodiscard]] geometry::SE3 T_camera_imu() const { return T_camera_lidar_ * T_lidar_imu_; }
  /// As the calibration counts them; 0: the rig file's.
  [[nodiscard]] std::uint64_t version() const { return version_; }

 private:
  geometry::SE3 T_camera_lidar_;
  geometry::SE3 T_lidar_imu_;
  std::uint64_t version_ = 0;
  std::int64_t stamp_ns_ = 0;
};

}  // namespace camvox::conversion
