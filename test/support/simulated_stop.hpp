#pragma once

#include <string>
#include <vector>

#include "camvox/calibration/scene.hpp"
#include "camvox/sensors/rig.hpp"
#include "camvox/simulation/simulator.hpp"

namespace camvox::test {

/// A place in a synthetic world where the robot stands still.
struct Stop {
  std::string world;  ///< plaza, campus, street, corridor.
  int seed = 1;
  double x_m = 0.0;
  double y_m = 0.0;
  double yaw_rad = 0.0;
};

/// What the rig sees there: one image, and the scans of some seconds. The rig is the default one.
inline calibration::Scene look_from(const Stop& stop, int seconds, int threads = 1) {
  simulation::SimulationOptions options;
  options.motion = "given";
  options.world.kind = stop.world;
  options.world.seed = stop.seed;
  options.world.people = stop.world == "corridor" ? 1 : 8;
  options.world.cars = stop.world == "campus" || stop.world == "street" ? 4 : 0;
  options.camera.rate_hz = 0.1;  // one image, at the start
  if (stop.world == "corridor") options.camera.gain = 0.7;
  options.truth_rate_hz = options.imu_rate_hz = options.gnss_rate_hz = 1.0;
  options.duration_s = seconds;
  const geometry::SE3 T_world_body(geometry::SO3::exp({0.0, 0.0, stop.yaw_rad}),
                                   {stop.x_m, stop.y_m, 0.0});
  const std::vector<geometry::SE3> poses(static_cast<std::size_t>(seconds) + 6, T_world_body);
  simulation::Simulator simulator(options, threads, simulation::Trajectory(poses, 1.0));
  calibration::Scene scene;
  while (const auto event = simulator.next()) {
    if (const auto* frame = std::get_if<simulation::SimulatedFrame>(&event->message)) {
      const auto& image = frame->image;
      scene.image.create(image.height_px, image.width_px, CV_8UC3);
      for (int row = 0; row < image.height_px; ++row) {
        for (int column = 0; column < image.width_px; ++column) {
          const auto* rgb = &image.rgb[3 * (static_cast<std::size_t>(row) *
                                                static_cast<std::size_t>(image.width_px) +
                                            static_cast<std::size_t>(column))];
          scene.image.at<cv::Vec3b>(row, column) = {rgb[2], rgb[1], rgb[0]};
        }
      }
    } else if (const auto* scan = std::get_if<simulation::LidarScan>(&event->message)) {
      for (const auto& point : scan->points) {
        scene.points_lidar.emplace_back(point.p_lidar.x(),
                                        point.p_lidar.y(),
                                        point.p_lidar.z(),
                                        static_cast<float>(point.reflectivity));
      }
    }
  }
  return scene;
}

/// The default rig's truth.
inline geometry::SE3 true_T_camera_lidar() {
  return sensors::make_rig_calibration().T_camera_lidar();
}

}  // namespace camvox::test
