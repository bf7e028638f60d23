#pragma once

#include <optional>

#include "camvox/import/import_report.hpp"
#include "camvox/simulation/options.hpp"
#include "camvox/simulation/trajectory.hpp"

namespace camvox::import {

/// How a simulated recording is written.
struct SimulatedBagOptions : ImportOptions {
  bool raw_images = false;    ///< sensor_msgs/Image instead of JPEG.
  bool truth_depth = false;   ///< Also the depth of every pixel of every image (32FC1, metres).
  bool truth_points = false;  ///< Also the lidar's points without noise and motion.
  int threads = 1;            ///< Of the simulator; the bytes do not depend on it.
  /// The motion for simulation::SimulationOptions::motion "given".
  std::optional<simulation::Trajectory> trajectory;
};

// Topics of what is true; only simulated recordings have them.
inline constexpr std::string_view kTruthOdometryTopic = "/ground_truth/odometry";
inline constexpr std::string_view kTruthDepthTopic = "/ground_truth/depth/image_raw";
inline constexpr std::string_view kTruthPointsTopic = "/ground_truth/points";
inline constexpr std::string_view kTruthBiasTopic = "/ground_truth/imu_bias";
inline constexpr std::string_view kTruthTransformsTopic = "/ground_truth/tf_static";

/// Simulates a recording and writes it as a robot with ROS 2 drivers would: images with
/// CameraInfo, Livox scans, IMU, GNSS and /tf_static (recorded calibration), all at the times of
/// their arrival, plus the truth: /ground_truth/odometry (base_link in world), /ground_truth/
/// imu_bias (the biases in the fields of an Imu), /ground_truth/tf_static (the true calibration).
///
/// Beside the bag's files: `rig.yaml` and `truth_rig.yaml` (parameters `camera` and `rig`, as
/// recorded and as true), `truth_body.tum` and `truth_camera.tum` (poses in world at the stamps of
/// the images; of the scans when there are no images), `loop_pairs.csv`, and `simulation.yaml`,
/// which makes the same recording again.
///
/// Throws config::ConfigError with all problems of `simulation`.
storage::Result<ImportReport> write_simulated_bag(const simulation::SimulationOptions& simulation,
                                                  const SimulatedBagOptions& options);

/// The poses of a TUM trajectory file as a smooth motion of the body. `T_body_sensor` is where the
/// sensor that the file is about sits; the body's first pose is the world's origin when
/// the file's first pose is the identity.
storage::Result<simulation::Trajectory> read_motion(const std::filesystem::path& tum_file,
                                                    const geometry::SE3& T_body_sensor);

}  // namespace camvox::import
