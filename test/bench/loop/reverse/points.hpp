#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "../drive.hpp"
#include "camvox/loop/surface_places.hpp"
#include "camvox/loop/surroundings.hpp"
#include "there_and_back.hpp"

namespace camvox::bench {

/// By keyframe, in its camera frame.
using Points = std::vector<std::vector<Eigen::Vector3f>>;

/// What the map of a run holds anyway: the features of keyframes, where lidar gave them depth.
inline Points feature_points(const Drive& drive) {
  Points points;
  for (const auto& frame : drive.frames) {
    points.push_back(loop::surface_points(
        frame.features, drive.camera, loop::SurfacePlacesConfig().max_depth_m));
  }
  return points;
}

/// A quarter of the lidar's returns, with its noise, free of the motion within a scan, each with
/// the keyframe nearest in time. Takes 0.2 s of processor time for a second of the drive, so they
/// are kept in a file.
class LidarPoints {
 public:
  static Points make(const ThereAndBack& drive,
                     double rate_hz,
                     const std::filesystem::path& cache) {
    Points points;
    if (read(cache, points)) return points;
    auto options = drive.options;
    options.images = false;
    options.imu_rate_hz = options.truth_rate_hz = 1.0;
    options.lidar.point_interval_ns *= 4;
    simulation::Simulator simulator(options, 1, drive.trajectory);
    const auto& rig = simulator.true_rig();
    points.resize(static_cast<std::size_t>(drive.trajectory.duration_s() * rate_hz) + 1);
    while (const auto event = simulator.next()) {
      const auto* scan = std::get_if<simulation::LidarScan>(&event->message);
      if (scan == nullptr) continue;
      const double time_s = 1e-9 * static_cast<double>(scan->stamp_ns - options.start_stamp_ns);
      const auto nearest = static_cast<std::size_t>((time_s + 0.05) * rate_hz + 0.5);
      const auto keyframe = std::min(nearest, points.size() - 1);
      const double keyframe_s = static_cast<double>(keyframe) / rate_hz;
      const auto T_camera_world = (drive.trajectory.pose(keyframe_s) * rig.T_body_camera).inverse();
      const auto T_camera_lidar = [&](double t_s) {
        return T_camera_world * drive.trajectory.pose(t_s) * rig.T_body_lidar();
      };
      add(*scan, time_s, T_camera_lidar, points[keyframe]);
    }
    for (auto& own : points) own = loop::thin(own, 0.15);
    write(cache, points);
    return points;
  }

 private:
  template <typename Pose>
  static void add(const simulation::LidarScan& scan,
                  double time_s,
                  const Pose& T_camera_lidar,
                  std::vector<Eigen::Vector3f>& points) {
    constexpr float kMaxRange_m = 60.0F;
    constexpr std::uint32_t kStep_ns = 2'000'000;  // 4 mm of the robot's way
    geometry::SE3 T;
    std::uint32_t step = ~0U;
    for (const auto& point : scan.points) {
      if (point.offset_ns / kStep_ns != step) {
        step = point.offset_ns / kStep_ns;
        T = T_camera_lidar(time_s + 1e-9 * (step + 0.5) * kStep_ns);
      }
      if (point.p_lidar.norm() > kMaxRange_m) continue;
      points.push_back((T * point.p_lidar.cast<double>()).cast<float>());
    }
  }

  static void write(const std::filesystem::path& path, const Points& points) {
    std::ofstream file(path, std::ios::binary);
    for (const auto& own : points) {
      const std::uint64_t size = own.size();
      file.write(reinterpret_cast<const char*>(&size), sizeof(size));
      file.write(reinterpret_cast<const char*>(own.data()),
                 static_cast<std::streamsize>(size * sizeof(own[0])));
    }
  }

  static bool read(const std::filesystem::path& path, Points& points) {
    std::ifstream file(path, std::ios::binary);
    std::uint64_t size = 0;
    while (file.read(reinterpret_cast<char*>(&size), sizeof(size))) {
      auto& own = points.emplace_back(size);
      file.read(reinterpret_cast<char*>(own.data()),
                static_cast<std::streamsize>(size * sizeof(own[0])));
    }
    return !points.empty();
  }
};

}  // namespace camvox::bench
