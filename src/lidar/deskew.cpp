#include "camvox/lidar/deskew.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::lidar {
namespace {

using geometry::SE3;
using geometry::Vector6d;

constexpr std::int64_t kKnot_ns = 1'000'000;

/// The transform's upper three rows; the last row is zero, so that a product with a point leaves
/// its fourth number, the reflectivity, to be added.
Eigen::Matrix4f to_knot(const SE3& T) {
  Eigen::Matrix4f knot = T.matrix().cast<float>();
  knot.row(3).setZero();
  return knot;
}

}  // namespace

ScanMotion::ScanMotion(const std::vector<Pose>& poses) : poses_(poses) {
  if (poses_.empty()) return;
  begin_ns_ = poses_.front().stamp_ns;
  const std::int64_t length_ns = poses_.back().stamp_ns - begin_ns_;
  const auto count = static_cast<std::size_t>(length_ns / kKnot_ns + 2);
  knots_.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    knots_.push_back(to_knot(T_image_lidar(begin_ns_ + static_cast<std::int64_t>(i) * kKnot_ns)));
  }
}

SE3 ScanMotion::T_image_lidar(std::int64_t stamp_ns) const {
  if (poses_.empty()) return {};
  const auto after = std::ranges::lower_bound(poses_, stamp_ns, {}, &Pose::stamp_ns);
  if (after == poses_.begin()) return after->T_image_lidar;
  if (after == poses_.end()) return poses_.back().T_image_lidar;
  const auto& before = *std::prev(after);
  const double ratio = static_cast<double>(stamp_ns - before.stamp_ns) /
                       static_cast<double>(after->stamp_ns - before.stamp_ns);
  return geometry::interpolate(before.T_image_lidar, after->T_image_lidar, ratio);
}

void ScanMotion::apply(std::span<const float[4]> points,
                       std::span<const std::uint32_t> offset_ns,
                       std::int64_t scan_stamp_ns,
                       std::span<float[4]> moved) const {
  using Row = Eigen::Map<Eigen::Vector4f>;
  if (knots_.empty()) {
    for (std::size_t i = 0; i < points.size(); ++i) std::copy_n(points[i], 4, moved[i]);
    return;
  }
  const auto last = static_cast<float>(knots_.size() - 1);
  constexpr auto kKnotsPerNs = static_cast<float>(1.0 / kKnot_ns);
  // Times from the first knot are below a second or two: a float resolves 0.1 us there.
  const auto shift = static_cast<float>(static_cast<double>(scan_stamp_ns - begin_ns_) / kKnot_ns);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float place =
        std::clamp(static_cast<float>(offset_ns[i]) * kKnotsPerNs + shift, 0.0F, last);
    const auto index = std::min(static_cast<std::size_t>(place), knots_.size() - 2);
    const float ratio = place - static_cast<float>(index);
    const auto& a = knots_[index];
    const auto& b = knots_[index + 1];
    const Eigen::Vector4f p(points[i][0], points[i][1], points[i][2], points[i][3]);
    const Eigen::Vector4f in_a = a.col(0) * p[0] + a.col(1) * p[1] + a.col(2) * p[2] + a.col(3);
    const Eigen::Vector4f in_b = b.col(0) * p[0] + b.col(1) * p[1] + b.col(2) * p[2] + b.col(3);
    Row row(&moved[i][0]);
    row = in_a + ratio * (in_b - in_a);
    row[3] = p[3];
  }
}

ScanMotion inertial_scan_motion(const ImuTrack& track,
                                const Eigen::Vector3d& gyro_bias_rad_s,
                                const std::optional<ImuMotion>& motion,
                                const ScanInterval& interval,
                                const SE3& T_imu_lidar) {
  const SE3 T_lidar_imu = T_imu_lidar.inverse();
  std::vector<ScanMotion::Pose> poses;
  const auto integrate = [&](std::int64_t end_ns) {
    SE3 T_image_imu;
    ImuMotion now = motion.value_or(ImuMotion{});
    double time_s = 0.0;
    for (auto step : track.steps(interval.image_ns, end_ns)) {
      if (!motion) step.force_m_s2.setZero();
      advance(step, gyro_bias_rad_s, T_image_imu, now);
      time_s += step.dt_s;
      poses.push_back({interval.image_ns + std::llround(1e9 * time_s),
                       T_lidar_imu * T_image_imu * T_imu_lidar});
    }
  };
  if (interval.begin_ns < interval.image_ns) integrate(interval.begin_ns);
  std::ranges::reverse(poses);
  poses.push_back({interval.image_ns, {}});
  if (interval.end_ns > interval.image_ns) integrate(interval.end_ns);
  return ScanMotion(poses);
}

ScanMotion constant_scan_motion(const Vector6d& velocity_camera,
                                const ScanInterval& interval,
                                const SE3& T_camera_lidar) {
  const Vector6d velocity_lidar = velocity_at(velocity_camera, T_camera_lidar);
  const auto pose = [&](std::int64_t stamp_ns) {
    const double time_s = 1e-9 * static_cast<double>(stamp_ns - interval.image_ns);
    return ScanMotion::Pose{stamp_ns, SE3::exp(time_s * velocity_lidar)};
  };
  const auto [first_ns, last_ns] =
      std::minmax({interval.begin_ns, interval.end_ns, interval.image_ns});
  if (first_ns == last_ns) return ScanMotion({pose(first_ns)});
  return ScanMotion({pose(first_ns), pose(last_ns)});
}

Vector6d velocity_at(const Vector6d& velocity_a, const SE3& T_a_b) {
  return T_a_b.inverse().adjoint() * velocity_a;
}

}  // namespace camvox::lidar
