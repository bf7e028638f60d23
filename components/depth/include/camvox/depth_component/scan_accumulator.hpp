#pragma once

#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "camvox/conversion/odometry_steps.hpp"
#include "camvox/depth/depth_projector.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/sensors/rig.hpp"

namespace camvox::depth_component {

/// Keeps the last scans and says where they were, seen from the newest: up to the last frame that
/// was tracked by odometry, from there by the motion that deskew used. Where either is missing
/// (lost, not deskewed), older scans are left out: the newest alone is never wrong.
class ScanAccumulator {
 public:
  static constexpr int kMaxScans = 20;

  /// `scans` from 1 to kMaxScans, the newest included.
  ScanAccumulator(int scans, const sensors::RigConfig& rig);

  void add_pose(const camvox_interfaces::msg::FramePose& pose);

  /// The scans to project, newest first. They are valid until the next call.
  [[nodiscard]] std::vector<depth::ScanView> add(const camvox_interfaces::msg::Cloud& cloud,
                                                 const geometry::SE3& T_camera_lidar);

 private:
  struct Kept {
    std::uint64_t frame_id;
    std::vector<float> points_lidar;
  };
  struct Tracked {
    std::uint64_t frame_id;
    std::int64_t stamp_ns;
  };

  [[nodiscard]] std::optional<geometry::SE3> motion_since_tracked(
      const camvox_interfaces::msg::Cloud& cloud) const;

  std::size_t scans_;
  geometry::SO3 R_lidar_imu_;
  conversion::OdometrySteps steps_;
  std::map<std::uint64_t, geometry::SE3> T_odometry_camera_;  ///< By frame; one unbroken chain.
  std::optional<Tracked> newest_;                             ///< Of the chain.
  std::deque<Kept> kept_;                                     ///< Newest first.
};

}  // namespace camvox::depth_component
