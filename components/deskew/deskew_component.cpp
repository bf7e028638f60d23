#include "camvox/deskew_component/deskew_component.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;
using geometry::SE3;
using geometry::Vector6d;

constexpr std::size_t kMaxWaiting = 4;  // scans in lockstep; sync sends no more ahead

std::int64_t max_gap_ns(const lidar::MotionFilterConfig& config) {
  return std::llround(1e9 * config.max_imu_gap_s);
}

lidar::ScanInterval interval_of(const msg::Scan& scan) {
  const std::int64_t first_ns = scan.header().stamp_ns();
  const auto* offsets = scan.point_offset_ns().data();
  const std::uint32_t last =
      scan.points_count() == 0 ? 0 : *std::max_element(offsets, offsets + scan.points_count());
  return {first_ns, first_ns + last, scan.image_stamp_ns()};
}

void write(const Eigen::Vector3d& vector, std::array<double, 3>& array) {
  Eigen::Vector3d::Map(array.data()) = vector;
}

}  // namespace

DeskewComponent::DeskewComponent(Context& context)
    : context_(context),
      config_(context.parameters<DeskewComponentConfig>()),
      rig_(sensors::make_rig_calibration(config_.rig)),
      extrinsics_(rig_),
      filter_(config_.motion),
      progress_(context),
      clouds_(context.advertise<Cloud>({"cloud", topics::kCloud}, {.qos = qos::kFrames})) {
  context.subscribe<Extrinsics>({"extrinsics", topics::kExtrinsics},
                                [this](const auto& extrinsics) { on_extrinsics(*extrinsics); },
                                {.qos = qos::kState, .required = false});
  context.subscribe<Scan>({"scan", topics::kScan},
                          [this](const auto& scan) { on_scan(scan); },
                          {.qos = qos::kFrames, .max_held = static_cast<int>(kMaxWaiting) + 1});
  context.subscribe<FramePose>({"frame_pose", topics::kFramePose},
                               [this](const auto& pose) { on_pose(*pose); },
                               {.qos = qos::kKeyframes, .required = config_.lockstep});
  context.every(std::chrono::seconds(1), [this] { report(); });
}

void DeskewComponent::on_extrinsics(const Extrinsics& extrinsics) {
  if (!extrinsics_.take(extrinsics)) return;
  filter_.forget_odometry();
  context_.log().info("extrinsics version {} from now on", extrinsics_.version());
}

void DeskewComponent::on_scan(const Sample<Scan>& scan) {
  const auto work = progress_.measure();
  if (!config_.lockstep) return process(*scan);
  waiting_.push_back(scan);
  process_waiting();
  if (waiting_.size() > kMaxWaiting) {  // tracking left a frame out: better late than never
    ++dropped_;
    process(*waiting_.front());
    waiting_.pop_front();
  }
}

void DeskewComponent::on_pose(const FramePose& pose) {
  const auto work = progress_.measure();
  newest_pose_id_ = std::max(newest_pose_id_, pose.header().frame_id());
  if (const auto step = steps_.add(pose)) {
    last_step_ = step;
  } else if (!steps_.tracked()) {
    last_step_.reset();
    filter_.forget_velocity();
  }
  if (config_.use_imu && last_step_ && last_step_->to_ns == pose.header().stamp_ns()) {
    const SE3 T_camera_imu = extrinsics_.T_camera_imu();
    const SE3 T_imu_step = T_camera_imu.inverse() * last_step_->T_from_to * T_camera_imu;
    filter_.add_odometry({last_step_->from_ns, last_step_->to_ns, T_imu_step});
  }
  process_waiting();
}

void DeskewComponent::process_waiting() {
  while (!waiting_.empty()) {
    if (newest_pose_id_ < last_scan_id_) return;
    process(*waiting_.front());
    waiting_.pop_front();
  }
}

void DeskewComponent::process(const Scan& scan) {
  last_scan_id_ = scan.header().frame_id();
  take_imu(scan);
  auto cloud = clouds_.loan();
  cloud->header().stamp_ns(scan.image_stamp_ns());
  cloud->header().frame_id(scan.header().frame_id());
  cloud->stationary(scan.stationary());
  const auto motion = motion_of(scan, *cloud);
  const std::size_t count = scan.points_count();
  motion.apply({reinterpret_cast<const float(*)[4]>(scan.points().data()), count},
               {scan.point_offset_ns().data(), count},
               scan.header().stamp_ns(),
               {reinterpret_cast<float(*)[4]>(cloud->points().data()), count});
  cloud->points_count(scan.points_count());
  write_rotation(scan, *cloud);
  ++by_mode_[cloud->deskew() & 3U];
  const auto header = cloud->header();
  clouds_.publish(std::move(cloud));
  previous_image_ns_ = scan.image_stamp_ns();
  previous_stationary_ = scan.stationary() != 0;
  progress_.done(header);
}

void DeskewComponent::take_imu(const Scan& scan) {
  if (!config_.use_imu) return;
  for (std::size_t i = 0; i < scan.imu_count(); ++i) {
    const auto& row = scan.imu()[i];
    filter_.add_reading({scan.imu_stamp_ns()[i],
                         Eigen::Vector3d(row[0], row[1], row[2]),
                         Eigen::Vector3d(row[3], row[4], row[5])});
  }
  if (scan.stationary() != 0 && previous_stationary_ && previous_image_ns_) {
    filter_.add_standstill(*previous_image_ns_, scan.image_stamp_ns());
  }
}

lidar::ScanMotion DeskewComponent::motion_of(const Scan& scan, Cloud& cloud) {
  const auto interval = interval_of(scan);
  const auto first_ns = std::min(interval.begin_ns, interval.image_ns);
  const auto last_ns = std::max(interval.end_ns, interval.image_ns);
  const auto gap_ns = max_gap_ns(config_.motion);
  if (config_.use_imu && filter_.track().covers(first_ns, last_ns, gap_ns)) {
    const auto motion = filter_.predict(interval.image_ns);
    cloud.deskew(motion ? msg::DESKEW_GYRO_AND_VELOCITY : msg::DESKEW_GYRO_ONLY);
    Vector6d velocity_imu;
    velocity_imu << filter_.track().omega_rad_s(interval.image_ns) - filter_.gyro_bias_rad_s(),
        motion.value_or(lidar::ImuMotion{}).v_imu;
    const auto velocity_lidar = lidar::velocity_at(velocity_imu, rig_.T_imu_lidar);
    write(velocity_lidar.head<3>(), cloud.angular_velocity_lidar());
    write(velocity_lidar.tail<3>(), cloud.velocity_lidar());
    return lidar::inertial_scan_motion(
        filter_.track(), filter_.gyro_bias_rad_s(), motion, interval, rig_.T_imu_lidar);
  }
  const double age_s =
      last_step_ ? 1e-9 * static_cast<double>(interval.image_ns - last_step_->to_ns) : 0.0;
  if (last_step_ && age_s <= config_.motion.max_odometry_age_s) {
    cloud.deskew(msg::DESKEW_CONSTANT_VELOCITY);
    const double duration_s = 1e-9 * static_cast<double>(last_step_->to_ns - last_step_->from_ns);
    const Vector6d velocity_camera = last_step_->T_from_to.log() / duration_s;
    const auto velocity_lidar = lidar::velocity_at(velocity_camera, extrinsics_.T_camera_lidar());
    write(velocity_lidar.head<3>(), cloud.angular_velocity_lidar());
    write(velocity_lidar.tail<3>(), cloud.velocity_lidar());
    return lidar::constant_scan_motion(velocity_camera, interval, extrinsics_.T_camera_lidar());
  }
  cloud.deskew(msg::DESKEW_NONE);
  return {};
}

void DeskewComponent::write_rotation(const Scan& scan, Cloud& cloud) const {
  const auto image_ns = scan.image_stamp_ns();
  const bool known =
      config_.use_imu && previous_image_ns_ && *previous_image_ns_ < image_ns &&
      filter_.track().covers(*previous_image_ns_, image_ns, max_gap_ns(config_.motion));
  if (!known) return;  // a new message is all zeros
  const auto q = lidar::integrate_rotation(filter_.track().steps(*previous_image_ns_, image_ns),
                                           filter_.gyro_bias_rad_s())
                     .quaternion();
  cloud.rotation_imu() = {q.x(), q.y(), q.z(), q.w()};
}

void DeskewComponent::report() {
  auto& diagnostics = context_.diagnostics();
  diagnostics.set("clouds.gyro_and_velocity", by_mode_[msg::DESKEW_GYRO_AND_VELOCITY]);
  diagnostics.set("clouds.gyro_only", by_mode_[msg::DESKEW_GYRO_ONLY]);
  diagnostics.set("clouds.constant_velocity", by_mode_[msg::DESKEW_CONSTANT_VELOCITY]);
  diagnostics.set("clouds.not_deskewed", by_mode_[msg::DESKEW_NONE]);
  diagnostics.set("lockstep.not_waited", dropped_);
  const auto& bias = filter_.gyro_bias_rad_s();
  diagnostics.set("gyro_bias_x_rad_s", bias.x());
  diagnostics.set("gyro_bias_y_rad_s", bias.y());
  diagnostics.set("gyro_bias_z_rad_s", bias.z());
  diagnostics.set("gyro_bias_sigma_rad_s", filter_.gyro_bias_sigma_rad_s());
}

}  // namespace camvox
