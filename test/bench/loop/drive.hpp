#pragma once

#include <cmath>
#include <filesystem>
#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "camvox/depth/sample_depth.hpp"
#include "camvox/features/feature_extractor.hpp"
#include "camvox/features/undistorter.hpp"
#include "camvox/optimization/point_observation.hpp"
#include "camvox/simulation/simulator.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::bench {

/// The keyframes of a simulated drive, as tracking would make them from perfect poses: features of
/// the images, depth from the truth with a lidar's noise and gaps. Rendering takes 0.35 s of
/// processor time per frame, so a drive is kept in a file.
struct Drive {
  std::vector<tracking::Keyframe> frames;  ///< T_map_camera is the truth in the world frame.
  optimization::PinholeCamera camera;

  /// `given`: the motion when options.motion is "given".
  static Drive make(simulation::SimulationOptions options,
                    double rate_hz,
                    const std::filesystem::path& cache,
                    std::optional<simulation::Trajectory> given = std::nullopt) {
    Drive drive;
    const auto& c = options.intrinsics;
    drive.camera = {c.fx_px, c.fy_px, c.cx_px, c.cy_px, 0.05};
    if (drive.read(cache)) return drive;
    options.camera.rate_hz = rate_hz;
    options.scans = false;
    options.truth_rate_hz = 1.0;
    options.imu_rate_hz = 1.0;
    simulation::Simulator simulator(options, 2, std::move(given));
    const features::Undistorter undistorter{sensors::CameraModel(c)};
    features::FeatureExtractor extractor({});
    while (const auto event = simulator.next()) {
      if (const auto* frame = std::get_if<simulation::SimulatedFrame>(&event->message)) {
        drive.add(*frame, undistorter, extractor);
      }
    }
    drive.write(cache);
    return drive;
  }

 private:
  void add(const simulation::SimulatedFrame& seen,
           const features::Undistorter& undistorter,
           features::FeatureExtractor& extractor) {
    const auto& image = seen.image;
    std::vector<std::uint8_t> grey(image.rgb.size() / 3);
    for (std::size_t i = 0; i < grey.size(); ++i) {
      grey[i] = static_cast<std::uint8_t>(
          (77 * image.rgb[3 * i] + 150 * image.rgb[3 * i + 1] + 29 * image.rgb[3 * i + 2]) / 256);
    }
    tracking::Keyframe frame;
    frame.frame_id = frames.size() + 1;
    frame.stamp_ns = seen.stamp_ns;
    frame.T_map_camera = seen.T_world_camera;
    extractor.extract({grey.data(), image.width_px, image.height_px, image.width_px},
                      frame.features);
    undistorter.undistort(frame.features);
    add_depth(seen.depth, frame.features);
    frames.push_back(std::move(frame));
  }

  /// Three quarters of the features get depth, up to 130 m; noise 2 cm and a little with range.
  void add_depth(const simulation::DepthImage& depth, features::FrameFeatures& features) {
    std::normal_distribution<float> noise;
    std::vector<float> sigma_m(depth.z_m.size());
    for (std::size_t i = 0; i < sigma_m.size(); ++i) sigma_m[i] = 0.02F + 0.001F * depth.z_m[i];
    const depth::DepthView view{depth.z_m.data(), sigma_m.data(), depth.width_px, depth.height_px};
    for (const auto& point : features.key_points) {
      auto sample = depth::sample_depth(view, point.u_px, point.v_px, 2);
      if (random_() % 4 == 0 || sample.depth_m > 130.0F) sample = {};
      if (sample.depth_m > 0.0F) sample.depth_m += sample.sigma_m * noise(random_);
      features.depth_m.push_back(sample.depth_m);
      features.depth_sigma_m.push_back(sample.sigma_m);
    }
  }

  template <typename T>
  static void put(std::ofstream& file, const std::vector<T>& list) {
    file.write(reinterpret_cast<const char*>(list.data()),
               static_cast<std::streamsize>(list.size() * sizeof(T)));
  }
  template <typename T>
  static void get(std::ifstream& file, std::vector<T>& list, std::size_t size) {
    list.resize(size);
    file.read(reinterpret_cast<char*>(list.data()), static_cast<std::streamsize>(size * sizeof(T)));
  }

  void write(const std::filesystem::path& path) const {
    std::ofstream file(path, std::ios::binary);
    for (const auto& frame : frames) {
      const Eigen::Matrix4d T = frame.T_map_camera.matrix();
      const std::uint64_t size = frame.features.size();
      file.write(reinterpret_cast<const char*>(T.data()), sizeof(double) * 16);
      file.write(reinterpret_cast<const char*>(&size), sizeof(size));
      put(file, frame.features.key_points);
      put(file, frame.features.undistorted_px);
      put(file, frame.features.descriptors);
      put(file, frame.features.depth_m);
      put(file, frame.features.depth_sigma_m);
    }
  }

  bool read(const std::filesystem::path& path) {
    std::ifstream file(path, std::ios::binary);
    Eigen::Matrix4d T;
    while (file.read(reinterpret_cast<char*>(T.data()), sizeof(double) * 16)) {
      std::uint64_t size = 0;
      file.read(reinterpret_cast<char*>(&size), sizeof(size));
      tracking::Keyframe frame;
      frame.frame_id = frames.size() + 1;
      frame.T_map_camera = geometry::SE3::from_matrix(T);
      get(file, frame.features.key_points, size);
      get(file, frame.features.undistorted_px, size);
      get(file, frame.features.descriptors, size);
      get(file, frame.features.depth_m, size);
      get(file, frame.features.depth_sigma_m, size);
      frames.push_back(std::move(frame));
    }
    return !frames.empty();
  }

  std::mt19937 random_{1};
};

}  // namespace camvox::bench
