#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/sensors/imu_noise.hpp"
#include "camvox/sensors/lidar_model.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/camera_renderer.hpp"
#include "camvox/simulation/world.hpp"

namespace camvox::simulation {

/// What goes wrong with messages on their way. YAML keys are the field names.
struct FaultOptions {
  double image_drop_probability = 0.0;  ///< Images that never arrive.
  double scan_drop_probability = 0.0;   ///< Lidar scans that never arrive.
  double imu_drop_probability = 0.0;    ///< IMU samples that never arrive.
  double gnss_drop_probability = 0.0;   ///< GNSS fixes that never arrive.
  double late_probability = 0.0;        ///< Messages of any kind that come late, out of order.
  double late_by_s = 0.15;              ///< How much later those come.
  double trigger_jitter_s = 0.0;        ///< Capture time of an image around its trigger, one sigma.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto zero = config::at_least(0.0);
    const auto one = config::at_most(1.0);
    field("image_drop_probability", self.image_drop_probability, zero, one);
    field("scan_drop_probability", self.scan_drop_probability, zero, one);
    field("imu_drop_probability", self.imu_drop_probability, zero, one);
    field("gnss_drop_probability", self.gnss_drop_probability, zero, one);
    field("late_probability", self.late_probability, zero, one);
    field("late_by_s", self.late_by_s, zero, config::at_most(10.0));
    field("trigger_jitter_s", self.trigger_jitter_s, zero, config::at_most(0.02));
  }
};

/// Everything about a simulated recording. YAML keys are the field names; presets() has ready
/// ones. The same options give the same events, byte for byte, with any number of threads.
struct SimulationOptions {
  std::int64_t seed = 1;             ///< Of all noise (the world has its own).
  double duration_s = 0.0;           ///< Stop after this time; 0: at the end of the motion.
  std::string motion = "loop_400m";  ///< loop_400m, campus_1800m, plaza_loop, corridor, rotation,
                                     ///< standstill, or given (a trajectory from the caller).
  double max_speed_m_s = 2.0;        ///< Of the robot.
  double bump_height_m = 0.006;      ///< Unevenness of the ground, one sigma.
  std::int64_t start_stamp_ns = 1'700'000'000'000'000'000;  ///< Stamp of time 0.
  double lidar_rate_hz = 10.0;  ///< Scans per second; images are triggered at scan starts.
  double imu_rate_hz = 200.0;
  double gnss_rate_hz = 5.0;
  double truth_rate_hz = 1000.0;    ///< Rate of the true states.
  double gnss_sigma_m = 0.02;       ///< Noise of an RTK fix, per axis.
  double latitude_deg = 22.5958;    ///< Of the world's origin.
  double longitude_deg = 113.9990;  ///< Of the world's origin.
  double altitude_m = 45.0;         ///< Of the world's origin, above the ellipsoid.
  bool images = true;               ///< Render the camera.
  bool scans = true;                ///< Simulate the lidar.
  std::vector<double> extrinsics_error_deg = {
      0.0, 0.0, 0.0};  ///< Recorded minus true T_lidar_camera.
  std::vector<double> extrinsics_error_m = {0.0, 0.0, 0.0};  ///< The same, translation.
  WorldConfig world;
  CameraOptions camera;
  sensors::CameraIntrinsics intrinsics;
  sensors::LidarModel lidar;
  sensors::ImuNoise imu;
  sensors::RigConfig rig;  ///< The true calibration.
  FaultOptions faults;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("seed", self.seed, config::at_least(0));
    field("duration_s", self.duration_s, config::at_least(0.0), config::at_most(86400.0));
    field("motion",
          self.motion,
          config::one_of({"loop_400m",
                          "campus_1800m",
                          "plaza_loop",
                          "corridor",
                          "rotation",
                          "standstill",
                          "given"}));
    field("max_speed_m_s", self.max_speed_m_s, positive, config::at_most(10.0));
    field("bump_height_m", self.bump_height_m, config::at_least(0.0), config::at_most(0.1));
    field("start_stamp_ns", self.start_stamp_ns, config::at_least(0));
    field("lidar_rate_hz", self.lidar_rate_hz, positive, config::at_most(100.0));
    field("imu_rate_hz", self.imu_rate_hz, positive, config::at_most(2000.0));
    field("gnss_rate_hz", self.gnss_rate_hz, positive, config::at_most(100.0));
    field("truth_rate_hz", self.truth_rate_hz, positive, config::at_most(10000.0));
    field("gnss_sigma_m", self.gnss_sigma_m, config::at_least(0.0), config::at_most(100.0));
    field("latitude_deg", self.latitude_deg, config::at_least(-89.0), config::at_most(89.0));
    field("longitude_deg", self.longitude_deg, config::at_least(-180.0), config::at_most(180.0));
    field("altitude_m", self.altitude_m, config::at_least(-500.0), config::at_most(9000.0));
    field("images", self.images);
    field("scans", self.scans);
    field("extrinsics_error_deg",
          self.extrinsics_error_deg,
          config::at_least(-20.0),
          config::at_most(20.0));
    field("extrinsics_error_m",
          self.extrinsics_error_m,
          config::at_least(-1.0),
          config::at_most(1.0));
    field("world", self.world);
    field("camera", self.camera);
    field("intrinsics", self.intrinsics);
    field("lidar", self.lidar);
    field("imu", self.imu);
    field("rig", self.rig);
    field("faults", self.faults);
  }
};

/// Everything that is wrong with `options`, nested ones and combinations included.
[[nodiscard]] std::vector<config::Problem> check(const SimulationOptions& options,
                                                 const std::string& origin = "simulation");

/// Names of the ready-made options: demo, loop_400m, campus_1800m, standstill, corridor, rotation,
/// dropouts.
[[nodiscard]] std::vector<std::string> preset_names();

/// Ready-made options. Throws config::ConfigError for an unknown name, with the nearest known.
[[nodiscard]] SimulationOptions preset(const std::string& name);

}  // namespace camvox::simulation
