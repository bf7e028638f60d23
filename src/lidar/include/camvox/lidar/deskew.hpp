#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "camvox/geometry/se3.hpp"
#include "camvox/lidar/imu_track.hpp"

namespace camvox::lidar {

/// How the lidar moved during a scan, as a table: T_image_lidar(t) takes a point from the lidar
/// frame at time t to the lidar frame at the image's time.
class ScanMotion {
 public:
  /// The pose at a few times, in order of time.
  struct Pose {
    std::int64_t stamp_ns = 0;
    geometry::SE3 T_image_lidar;
  };

  /// No motion at all.
  ScanMotion() = default;
  /// Interpolates the poses on SE(3), at constant body velocity in between, to a table of knots
  /// 1 ms apart. Outside the poses the first or last one holds.
  explicit ScanMotion(const std::vector<Pose>& poses);

  [[nodiscard]] geometry::SE3 T_image_lidar(std::int64_t stamp_ns) const;

  /// Moves returns to the image's time. Row i of `points` (x y z m in the lidar frame at its own
  /// time, reflectivity) was measured `offset_ns[i]` after `scan_stamp_ns`; `moved` gets it in the
  /// lidar frame at the image's time. Between knots matrices are interpolated linearly: for 1 rad/s
  /// that is 0.1 microrad off. `moved` may be `points`.
  void apply(std::span<const float[4]> points,
             std::span<const std::uint32_t> offset_ns,
             std::int64_t scan_stamp_ns,
             std::span<float[4]> moved) const;

 private:
  std::vector<Pose> poses_;
  std::int64_t begin_ns_ = 0;
  std::vector<Eigen::Matrix4f> knots_;  // empty: no motion
};

/// Where the lidar is on the rig.
struct LidarMounting {
  geometry::SE3 T_imu_lidar;
  geometry::SE3 T_camera_lidar;
};

/// An interval of lidar time around an image.
struct ScanInterval {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  std::int64_t image_ns = 0;
};

/// The motion from gyro and, if `motion` is given (the IMU's at the image's time), velocity and
/// accelerometer, integrated reading by reading from the image's time to both ends. Without it the
/// IMU turns about its own origin.
[[nodiscard]] ScanMotion inertial_scan_motion(const ImuTrack& track,
                                              const Eigen::Vector3d& gyro_bias_rad_s,
                                              const std::optional<ImuMotion>& motion,
                                              const ScanInterval& interval,
                                              const geometry::SE3& T_imu_lidar);

/// The motion at a constant velocity of the camera, in its own axes: [rotation rad/s; translation
/// m/s] as SE3::log gives it for the movement of one second.
[[nodiscard]] ScanMotion constant_scan_motion(const geometry::Vector6d& velocity_camera,
                                              const ScanInterval& interval,
                                              const geometry::SE3& T_camera_lidar);

/// A rigid body's velocity at another place on it: `velocity_a` is [omega; v] of frame a in its own
/// axes, the result that of frame b in its own.
[[nodiscard]] geometry::Vector6d velocity_at(const geometry::Vector6d& velocity_a,
                                             const geometry::SE3& T_a_b);

}  // namespace camvox::lidar
