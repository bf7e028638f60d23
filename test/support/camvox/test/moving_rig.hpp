#pragma once

#include <cmath>
#include <numbers>
#include <vector>

#include "camvox/lidar/imu_track.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/inertial.hpp"
#include "camvox/simulation/random.hpp"
#include "camvox/simulation/trajectory.hpp"

namespace camvox::test {

/// Returns of one scan with their truth; row i of all lists is return i.
struct MovingScan {
  std::int64_t stamp_ns = 0;
  std::vector<std::array<float, 4>> points;  ///< As measured: in the lidar frame at its own time.
  std::vector<std::uint32_t> offset_ns;
  std::vector<Eigen::Vector3d> p_image;  ///< In the lidar frame at the image's time.
};

/// A rig that moves through a known trajectory, with the CamVox rig's mounting; times in ns from 0.
/// Its lidar measures without noise: what is left after deskewing is the deskew's own error.
class MovingRig {
 public:
  explicit MovingRig(simulation::Trajectory trajectory,
                     const sensors::RigCalibration& rig = sensors::make_rig_calibration())
      : trajectory_(std::move(trajectory)), rig_(rig) {}

  /// Drives circles of 2 m radius at 2 m/s and 1 rad/s over uneven ground.
  static MovingRig driving(double duration_s) {
    return sampled(duration_s, [](double t) {
      const Eigen::Vector3d position(
          2.0 * std::sin(t), 2.0 - 2.0 * std::cos(t), 0.005 * std::sin(9.0 * t));
      const auto yaw = geometry::SO3::exp({0.0, 0.0, t});
      return geometry::SE3(
          yaw * geometry::SO3::exp({0.01 * std::sin(11.0 * t), 0.012 * std::cos(8.0 * t), 0.0}),
          position);
    });
  }
  /// Shakes about all axes: speed up to 2 m/s, turns up to 1 rad/s, accelerations up to 8 m/s^2.
  static MovingRig handheld(double duration_s) {
    return sampled(duration_s, [](double t) {
      const Eigen::Vector3d position(
          0.5 * std::sin(4.0 * t), 0.6 * t + 0.3 * std::sin(3.1 * t), 0.15 * std::sin(4.7 * t));
      return geometry::SE3(
          geometry::SO3::exp(
              {0.2 * std::sin(3.3 * t), 0.25 * std::sin(2.9 * t + 1.0), 0.5 * std::sin(1.9 * t)}),
          position);
    });
  }

  [[nodiscard]] const sensors::RigCalibration& rig() const { return rig_; }
  [[nodiscard]] geometry::SE3 T_world_lidar(std::int64_t time_ns) const {
    return trajectory_.pose(seconds(time_ns)) * rig_.T_body_lidar();
  }
  [[nodiscard]] geometry::SE3 T_world_camera(std::int64_t time_ns) const {
    return trajectory_.pose(seconds(time_ns)) * rig_.T_body_camera;
  }
  [[nodiscard]] geometry::SE3 T_world_imu(std::int64_t time_ns) const {
    return trajectory_.pose(seconds(time_ns)) * rig_.T_body_imu();
  }

  /// The IMU's readings at 200 Hz with `noise`.
  [[nodiscard]] std::vector<lidar::ImuReading> imu(std::int64_t from_ns,
                                                   std::int64_t to_ns,
                                                   const sensors::ImuNoise& noise,
                                                   std::uint64_t seed = 1) const {
    simulation::ImuErrors errors(noise, 200.0, seed);
    std::vector<lidar::ImuReading> readings;
    for (std::int64_t time_ns = from_ns; time_ns <= to_ns; time_ns += 5'000'000) {
      const auto sample = errors.next(
          simulation::ideal_imu(trajectory_.state(seconds(time_ns)), rig_.T_body_imu()));
      readings.push_back({time_ns, sample.omega_rad_s, sample.force_m_s2});
    }
    return readings;
  }

  /// `count` returns at a range, spread over the Horizon's field of view and a time of 0.1 s.
  [[nodiscard]] MovingScan scan(std::int64_t begin_ns,
                                std::int64_t image_ns,
                                std::size_t count,
                                double range_m = 30.0) const {
    constexpr double kHalfWidth_rad = 0.71, kHalfHeight_rad = 0.22, kDuration_ns = 1e8;
    const simulation::CounterRandom random(7, static_cast<std::uint64_t>(begin_ns));
    const auto T_image_world = T_world_lidar(image_ns).inverse();
    MovingScan scan;
    scan.stamp_ns = begin_ns;
    for (std::size_t i = 0; i < count; ++i) {
      const double azimuth = random.between(-kHalfWidth_rad, kHalfWidth_rad, i, 0);
      const double elevation = random.between(-kHalfHeight_rad, kHalfHeight_rad, i, 1);
      const Eigen::Vector3d p_lidar =
          range_m * Eigen::Vector3d(std::cos(azimuth) * std::cos(elevation),
                                    std::sin(azimuth) * std::cos(elevation),
                                    std::sin(elevation));
      const auto offset_ns = static_cast<std::uint32_t>(kDuration_ns * static_cast<double>(i) /
                                                        static_cast<double>(count));
      scan.points.push_back({static_cast<float>(p_lidar.x()),
                             static_cast<float>(p_lidar.y()),
                             static_cast<float>(p_lidar.z()),
                             50.0F});
      scan.offset_ns.push_back(offset_ns);
      scan.p_image.push_back(T_image_world * T_world_lidar(begin_ns + offset_ns) * p_lidar);
    }
    return scan;
  }

 private:
  static double seconds(std::int64_t time_ns) { return 1e-9 * static_cast<double>(time_ns); }
  template <typename Pose>
  static MovingRig sampled(double duration_s, Pose pose) {
    constexpr double kKnot_s = 0.025;
    std::vector<geometry::SE3> poses;
    for (double t = 0.0; t <= duration_s; t += kKnot_s) poses.push_back(pose(t));
    return MovingRig(simulation::Trajectory(poses, kKnot_s));
  }

  simulation::Trajectory trajectory_;
  sensors::RigCalibration rig_;
};

/// Root mean square distance of points to the truth.
template <typename Points>
[[nodiscard]] double rms_error_m(const Points& points, const MovingScan& truth) {
  double sum_m2 = 0.0;
  for (std::size_t i = 0; i < truth.p_image.size(); ++i) {
    const Eigen::Vector3d p(static_cast<double>(points[i][0]),
                            static_cast<double>(points[i][1]),
                            static_cast<double>(points[i][2]));
    sum_m2 += (p - truth.p_image[i]).squaredNorm();
  }
  return std::sqrt(sum_m2 / static_cast<double>(truth.p_image.size()));
}

/// One step of visual odometry from the truth, with noise.
[[nodiscard]] inline geometry::SE3 noisy_step(const geometry::SE3& T_from_to,
                                              double sigma_m,
                                              double sigma_rad,
                                              std::uint64_t index) {
  const simulation::CounterRandom random(11, 0);
  geometry::Vector6d noise;
  for (int axis = 0; axis < 6; ++axis) {
    noise[axis] =
        (axis < 3 ? sigma_rad : sigma_m) * random.normal(index, static_cast<std::uint64_t>(axis));
  }
  return geometry::retract(T_from_to, noise);
}

}  // namespace camvox::test
