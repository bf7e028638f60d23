#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/conversion/extrinsics_in_force.hpp"
#include "camvox/conversion/odometry_steps.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/lidar/deskew.hpp"
#include "camvox/lidar/inertial_motion.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox {

/// Parameters of DeskewComponent. YAML keys are the field names.
struct DeskewComponentConfig {
  bool use_imu = true;    ///< False: constant velocity from odometry, as if there were no IMU.
  bool lockstep = false;  ///< Scan k waits for the pose of frame k-1.
  lidar::MotionFilterConfig motion;
  sensors::RigConfig rig;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("use_imu", self.use_imu);
    field("lockstep", self.lockstep);
    field("motion", self.motion);
    field("rig", self.rig);
  }
};

/// Moves the returns of every scan to the lidar frame at the image's time: one cloud for each scan.
/// What the motion was made of stands in Cloud::deskew; the best that the data allow is taken:
/// gyro, accelerometer and odometry's velocity; gyro alone; constant velocity from odometry (no
/// IMU); nothing, and then the points are as measured. New extrinsics that passed their gate take
/// effect at once: odometry is the camera's, the IMU sits on the lidar.
class DeskewComponent final : public Component {
 public:
  explicit DeskewComponent(Context& context);

 private:
  using Cloud = camvox_interfaces::msg::Cloud;
  using Extrinsics = camvox_interfaces::msg::Extrinsics;
  using FramePose = camvox_interfaces::msg::FramePose;
  using Scan = camvox_interfaces::msg::Scan;

  void on_extrinsics(const Extrinsics& extrinsics);
  void on_scan(const Sample<Scan>& scan);
  void on_pose(const FramePose& pose);
  void process_waiting();
  void process(const Scan& scan);
  void take_imu(const Scan& scan);
  [[nodiscard]] lidar::ScanMotion motion_of(const Scan& scan, Cloud& cloud);
  void write_rotation(const Scan& scan, Cloud& cloud) const;
  void report();

  Context& context_;
  DeskewComponentConfig config_;
  sensors::RigCalibration rig_;
  conversion::ExtrinsicsInForce extrinsics_;
  lidar::InertialMotionFilter filter_;
  conversion::OdometrySteps steps_;
  std::optional<conversion::CameraStep> last_step_;
  ProgressReporter progress_;
  Publisher<Cloud> clouds_;
  std::deque<Sample<Scan>> waiting_;  // in lockstep, for poses
  std::uint64_t newest_pose_id_ = 0;
  std::uint64_t last_scan_id_ = 0;
  std::optional<std::int64_t> previous_image_ns_;
  bool previous_stationary_ = false;
  std::uint64_t by_mode_[4] = {};
  std::uint64_t dropped_ = 0;
};

}  // namespace camvox
