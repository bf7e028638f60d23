#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::lidar {

/// One measurement of the IMU, in its own frame.
struct ImuReading {
  std::int64_t stamp_ns = 0;
  Eigen::Vector3d omega_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_m_s2 = Eigen::Vector3d::Zero();  ///< Specific force: +g upwards at rest.
};

/// Angular rate and specific force over a short time, both constant in the IMU's turning axes.
struct ImuStep {
  double dt_s = 0.0;  ///< Negative: back in time.
  Eigen::Vector3d omega_rad_s = Eigen::Vector3d::Zero();
  Eigen::Vector3d force_m_s2 = Eigen::Vector3d::Zero();
};

/// Keeps the latest IMU readings, and breaks any interval of time into steps.
class ImuTrack {
 public:
  /// Readings not newer than the last one are ignored, so overlapping batches can be added.
  void add(const ImuReading& reading);
  void forget_before(std::int64_t stamp_ns);
  void clear() { readings_.clear(); }

  [[nodiscard]] bool empty() const { return readings_.empty(); }
  [[nodiscard]] std::size_t size() const { return readings_.size(); }
  /// The latest stamp; nothing when there are no readings.
  [[nodiscard]] std::optional<std::int64_t> newest_ns() const {
    return readings_.empty() ? std::nullopt : std::optional(readings_.back().stamp_ns);
  }
  /// Whether an interval can be integrated: no gap in it, and none at its ends, longer than that.
  [[nodiscard]] bool covers(std::int64_t begin_ns,
                            std::int64_t end_ns,
                            std::int64_t max_gap_ns) const;
  /// Steps from one time to another, which may be earlier. Rates vary linearly between readings;
  /// beyond the first and last reading they stay constant.
  [[nodiscard]] std::vector<ImuStep> steps(std::int64_t from_ns, std::int64_t to_ns) const;
  /// The angular rate at a time; zero when there are no readings.
  [[nodiscard]] Eigen::Vector3d omega_rad_s(std::int64_t stamp_ns) const;

 private:
  [[nodiscard]] ImuReading at(std::int64_t stamp_ns) const;

  std::deque<ImuReading> readings_;  // by stamp
};

/// What is known of the IMU's motion at one moment, in its own axes of that moment.
struct ImuMotion {
  Eigen::Vector3d v_imu = Eigen::Vector3d::Zero();        ///< m/s, over ground.
  Eigen::Vector3d gravity_imu = Eigen::Vector3d::Zero();  ///< m/s^2, downwards.
};

/// Moves pose and motion through one step. `T_start_imu` is the IMU's pose in any fixed frame.
/// Second order in dt: the force acts in the axes of the middle of the step.
void advance(const ImuStep& step,
             const Eigen::Vector3d& gyro_bias_rad_s,
             geometry::SE3& T_start_imu,
             ImuMotion& motion);

/// R_imu(from)_imu(to) by the gyro.
[[nodiscard]] geometry::SO3 integrate_rotation(std::span<const ImuStep> steps,
                                               const Eigen::Vector3d& gyro_bias_rad_s);

}  // namespace camvox::lidar
