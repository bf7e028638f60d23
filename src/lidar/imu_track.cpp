#include "camvox/lidar/imu_track.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::lidar {

using geometry::SE3;
using geometry::SO3;

void ImuTrack::add(const ImuReading& reading) {
  if (!readings_.empty() && reading.stamp_ns <= readings_.back().stamp_ns) return;
  readings_.push_back(reading);
}

void ImuTrack::forget_before(std::int64_t stamp_ns) {
  while (readings_.size() > 1 && readings_[1].stamp_ns <= stamp_ns) readings_.pop_front();
}

bool ImuTrack::covers(std::int64_t begin_ns, std::int64_t end_ns, std::int64_t max_gap_ns) const {
  // The readings at or before the begin, in between, and at or after the end.
  auto next = std::ranges::upper_bound(readings_, begin_ns, {}, &ImuReading::stamp_ns);
  std::int64_t last_ns = next == readings_.begin() ? begin_ns : std::prev(next)->stamp_ns;
  for (; last_ns < end_ns && next != readings_.end(); ++next) {
    if (next->stamp_ns - last_ns > max_gap_ns) return false;
    last_ns = next->stamp_ns;
  }
  return !readings_.empty() && end_ns - last_ns <= max_gap_ns;
}

ImuReading ImuTrack::at(std::int64_t stamp_ns) const {
  const auto after = std::ranges::lower_bound(readings_, stamp_ns, {}, &ImuReading::stamp_ns);
  ImuReading result;
  if (after == readings_.end()) {
    result = readings_.back();
  } else if (after == readings_.begin() || after->stamp_ns == stamp_ns) {
    result = *after;
  } else {
    const auto& before = *std::prev(after);
    const double ratio = static_cast<double>(stamp_ns - before.stamp_ns) /
                         static_cast<double>(after->stamp_ns - before.stamp_ns);
    result.omega_rad_s = (1.0 - ratio) * before.omega_rad_s + ratio * after->omega_rad_s;
    result.force_m_s2 = (1.0 - ratio) * before.force_m_s2 + ratio * after->force_m_s2;
  }
  result.stamp_ns = stamp_ns;
  return result;
}

Eigen::Vector3d ImuTrack::omega_rad_s(std::int64_t stamp_ns) const {
  return readings_.empty() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : at(stamp_ns).omega_rad_s;
}

std::vector<ImuStep> ImuTrack::steps(std::int64_t from_ns, std::int64_t to_ns) const {
  if (readings_.empty() || from_ns == to_ns) return {};
  const std::int64_t first_ns = std::min(from_ns, to_ns), last_ns = std::max(from_ns, to_ns);
  std::vector<ImuReading> nodes = {at(first_ns)};
  auto next = std::ranges::upper_bound(readings_, first_ns, {}, &ImuReading::stamp_ns);
  for (; next != readings_.end() && next->stamp_ns < last_ns; ++next) nodes.push_back(*next);
  nodes.push_back(at(last_ns));
  const double direction = from_ns < to_ns ? 1.0 : -1.0;
  std::vector<ImuStep> steps;
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const auto& a = nodes[i - 1];
    const auto& b = nodes[i];
    steps.push_back({direction * 1e-9 * static_cast<double>(b.stamp_ns - a.stamp_ns),
                     0.5 * (a.omega_rad_s + b.omega_rad_s),
                     0.5 * (a.force_m_s2 + b.force_m_s2)});
  }
  if (direction < 0.0) std::ranges::reverse(steps);
  return steps;
}

void advance(const ImuStep& step,
             const Eigen::Vector3d& gyro_bias_rad_s,
             SE3& T_start_imu,
             ImuMotion& motion) {
  const Eigen::Vector3d turn = step.dt_s * (step.omega_rad_s - gyro_bias_rad_s);
  const Eigen::Vector3d a_imu = SO3::exp(0.5 * turn) * step.force_m_s2 + motion.gravity_imu;
  const Eigen::Vector3d move = step.dt_s * motion.v_imu + 0.5 * step.dt_s * step.dt_s * a_imu;
  const SO3 R_before_after = SO3::exp(turn);
  T_start_imu = T_start_imu * SE3(R_before_after, move);
  const SO3 R_after_before = R_before_after.inverse();
  motion.v_imu = R_after_before * (motion.v_imu + step.dt_s * a_imu);
  motion.gravity_imu = R_after_before * motion.gravity_imu;
}

SO3 integrate_rotation(std::span<const ImuStep> steps, const Eigen::Vector3d& gyro_bias_rad_s) {
  SO3 R;
  for (const auto& step : steps) R = R * SO3::exp(step.dt_s * (step.omega_rad_s - gyro_bias_rad_s));
  return R;
}

}  // namespace camvox::lidar
