#include "camvox/depth_component/scan_accumulator.hpp"

#include <cmath>

namespace camvox::depth_component {
namespace {

namespace msg = camvox_interfaces::msg;
using geometry::SE3;
using geometry::SO3;

/// Longer ahead, constant velocity is not worth its name.
constexpr double kMaxAhead_s = 0.25;
constexpr std::size_t kPosesKept = 64;

std::span<const float> points_of(const msg::Cloud& cloud) {
  return {cloud.points()[0].data(), 4 * std::size_t{cloud.points_count()}};
}

}  // namespace

ScanAccumulator::ScanAccumulator(int scans, const sensors::RigConfig& rig)
    : scans_(static_cast<std::size_t>(scans)),
      R_lidar_imu_(sensors::make_rig_calibration(rig).T_imu_lidar.rotation().inverse()) {}

void ScanAccumulator::add_pose(const msg::FramePose& pose) {
  const auto step = steps_.add(pose);
  const auto frame_id = pose.header().frame_id();
  // An id that goes back begins a chain of its own, or the limit below would take out its frames.
  const bool goes_back = newest_ && frame_id <= newest_->frame_id;
  const bool begins = !step || !newest_ || goes_back;
  const SE3 T_odometry_last = begins ? SE3() : T_odometry_camera_.at(newest_->frame_id);
  if (begins) T_odometry_camera_.clear();
  if (goes_back) kept_.clear();
  newest_.reset();
  if (!steps_.tracked()) return;
  newest_ = Tracked{frame_id, pose.header().stamp_ns()};
  T_odometry_camera_[frame_id] = begins ? SE3() : T_odometry_last * step->T_from_to;
  while (T_odometry_camera_.size() > kPosesKept) {
    T_odometry_camera_.erase(T_odometry_camera_.begin());
  }
}

/// T_lidar(last tracked frame)_lidar(this cloud).
std::optional<SE3> ScanAccumulator::motion_since_tracked(const msg::Cloud& cloud) const {
  const bool velocity_known = cloud.deskew() == msg::DESKEW_GYRO_AND_VELOCITY ||
                              cloud.deskew() == msg::DESKEW_CONSTANT_VELOCITY;
  if (!newest_ || !velocity_known) return std::nullopt;
  const double ahead_s = 1e-9 * static_cast<double>(cloud.header().stamp_ns() - newest_->stamp_ns);
  if (!(ahead_s > 0.0 && ahead_s <= kMaxAhead_s)) return std::nullopt;
  const Eigen::Vector3d omega_rad_s(cloud.angular_velocity_lidar().data());
  const Eigen::Vector3d v_m_s(cloud.velocity_lidar().data());
  const SO3 half = SO3::exp(0.5 * ahead_s * omega_rad_s);
  SO3 R_then_now = half * half;
  const auto& gyro = cloud.rotation_imu();
  const Eigen::Quaterniond q(gyro[3], gyro[0], gyro[1], gyro[2]);
  const bool follows = newest_->frame_id + 1 == cloud.header().frame_id();
  if (follows && std::abs(q.norm() - 1.0) < 1e-3) {  // integrated: better than the last rate
    R_then_now = R_lidar_imu_ * SO3(q) * R_lidar_imu_.inverse();
  }
  return SE3(R_then_now, R_then_now * half.inverse() * (ahead_s * v_m_s));
}

std::vector<depth::ScanView> ScanAccumulator::add(const msg::Cloud& cloud,
                                                  const SE3& T_camera_lidar) {
  while (kept_.size() >= scans_) kept_.pop_back();
  std::vector<depth::ScanView> views = {{points_of(cloud), T_camera_lidar}};
  if (scans_ == 1) return views;
  if (const auto T_lidar_then_now = motion_since_tracked(cloud)) {
    const SE3 T_now_then = T_camera_lidar * T_lidar_then_now->inverse() * T_camera_lidar.inverse();
    const SE3 T_now_odometry = T_now_then * T_odometry_camera_.at(newest_->frame_id).inverse();
    for (const auto& scan : kept_) {
      const auto pose = T_odometry_camera_.find(scan.frame_id);
      if (pose == T_odometry_camera_.end() || views.size() == scans_) continue;
      views.push_back({scan.points_lidar, T_now_odometry * pose->second * T_camera_lidar});
    }
  }
  const auto points = points_of(cloud);
  kept_.push_front({cloud.header().frame_id(), {points.begin(), points.end()}});
  return views;
}

}  // namespace camvox::depth_component
