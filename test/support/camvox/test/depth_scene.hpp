#pragma once

#include <cmath>
#include <cstdint>
#include <vector>

#include "camvox/simulation/camera_renderer.hpp"
#include "camvox/simulation/lidar_scanner.hpp"
#include "camvox/simulation/simulator.hpp"

namespace camvox::test {

/// One frame with a perfectly deskewed scan: the robot and all that moves stood still for it.
struct DepthScene {
  std::vector<float> points_lidar;  ///< Rows of x y z reflectivity.
  simulation::ColorImage image;
  simulation::DepthImage truth;
};

/// Makes such frames along the motion of a simulation.
class DepthSceneMaker {
 public:
  explicit DepthSceneMaker(simulation::SimulationOptions options, int threads = 2)
      : options_(std::move(options)),
        threads_(threads),
        rig_(sensors::make_rig_calibration(options_.rig)),
        camera_(options_.intrinsics),
        motion_(without_sensors(options_)),
        world_(frozen(motion_.world())),
        shader_(world_.seed, threads),
        scene_(world_),
        renderer_(camera_, options_.camera, world_, shader_),
        scanner_(options_.lidar, static_cast<std::uint64_t>(options_.seed), shader_) {}
  DepthSceneMaker(const DepthSceneMaker&) = delete;
  DepthSceneMaker& operator=(const DepthSceneMaker&) = delete;

  /// `scans` of 100 ms are laid over each other; the lidar's pattern goes on between them.
  [[nodiscard]] DepthScene make(double time_s, int scans = 1) {
    const geometry::SE3 T_world_body = motion_.trajectory().pose(time_s);
    const geometry::SE3 T_world_lidar = T_world_body * rig_.T_body_lidar();
    DepthScene result;
    simulation::CameraMotion camera;
    camera.time_s = time_s;
    camera.T_world_camera = [&](double) { return T_world_body * rig_.T_body_camera; };
    auto rendering = renderer_.render(scene_, camera, threads_);
    result.image = std::move(rendering.image);
    result.truth = std::move(rendering.depth);
    for (int i = 0; i < scans; ++i) {
      const simulation::ScanPeriod period{std::llround(time_s * 1e9) + i * 100'000'000,
                                          100'000'000,
                                          [&](double) { return T_world_lidar; }};
      for (const auto& point : scanner_.scan(scene_, period, threads_).points) {
        const auto& p = point.p_lidar;
        result.points_lidar.insert(result.points_lidar.end(),
                                   {p.x(), p.y(), p.z(), static_cast<float>(point.reflectivity)});
      }
    }
    return result;
  }

  [[nodiscard]] const sensors::CameraModel& camera() const { return camera_; }
  [[nodiscard]] geometry::SE3 T_camera_lidar() const { return rig_.T_camera_lidar(); }
  [[nodiscard]] double duration_s() const { return motion_.duration_s(); }

 private:
  static simulation::Simulator without_sensors(simulation::SimulationOptions options) {
    options.images = false;
    options.scans = false;
    return simulation::Simulator(options);
  }
  static simulation::World frozen(simulation::World world) {
    for (auto& object : world.moving) object.speed_m_s = 0.0F;
    return world;
  }

  simulation::SimulationOptions options_;
  int threads_;
  sensors::RigCalibration rig_;
  sensors::CameraModel camera_;
  simulation::Simulator motion_;
  simulation::World world_;
  simulation::SurfaceShader shader_;
  simulation::RayScene scene_;
  simulation::CameraRenderer renderer_;
  simulation::LidarScanner scanner_;
};

/// How a depth image compares with the truth, over many images.
struct DepthJudgement {
  std::uint64_t pixels = 0;  ///< With a true depth in the lidar's range.
  std::uint64_t filled = 0;
  std::uint64_t behind = 0;    ///< Filled more than 3 sigma behind the true surface.
  std::uint64_t in_front = 0;  ///< The same in front of it, or where there is nothing.
  std::uint64_t far_off = 0;   ///< Filled more than 5 sigma off.
  double sum = 0.0;            ///< Of errors in sigma, those within 5 sigma.
  double sum2 = 0.0;
  double relative_sigma = 0.0;  ///< Sum of sigma / depth.

  void add(const float* depth_m, const float* sigma_m, const simulation::DepthImage& truth) {
    for (std::size_t i = 0; i < truth.z_m.size(); ++i) {
      const float z = truth.z_m[i];
      const bool seen = z > 0.0F && z < 130.0F;
      pixels += seen ? 1 : 0;
      if (!(depth_m[i] > 0.0F)) continue;
      ++filled;
      const double error = z > 0.0F ? (depth_m[i] - z) / sigma_m[i] : -100.0;
      behind += error > 3.0 ? 1 : 0;
      in_front += error < -3.0 ? 1 : 0;
      relative_sigma += sigma_m[i] / depth_m[i];
      if (std::abs(error) > 5.0) {
        ++far_off;
        continue;
      }
      sum += error;
      sum2 += error * error;
    }
  }
  [[nodiscard]] double fill() const { return ratio(filled, pixels); }
  [[nodiscard]] double behind_share() const { return ratio(behind, filled); }
  [[nodiscard]] double in_front_share() const { return ratio(in_front, filled); }
  [[nodiscard]] double far_off_share() const { return ratio(far_off, filled); }
  [[nodiscard]] double mean() const { return sum / static_cast<double>(filled - far_off); }
  /// Standard deviation of the error in sigmas, without those beyond 5.
  [[nodiscard]] double deviation() const {
    const double m = mean();
    return std::sqrt(sum2 / static_cast<double>(filled - far_off) - m * m);
  }

 private:
  static double ratio(std::uint64_t part, std::uint64_t whole) {
    return static_cast<double>(part) / static_cast<double>(whole);
  }
};

}  // namespace camvox::test
