#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/lidar_model.hpp"
#include "camvox/simulation/ray_scene.hpp"
#include "camvox/simulation/surface_shader.hpp"

namespace camvox::simulation {

/// One return, in the layout of Livox's CustomPoint: coordinates in the lidar frame at the
/// point's own time, in whole millimetres.
struct LidarPoint {
  std::uint32_t offset_ns = 0;    ///< After the scan's stamp.
  Eigen::Vector3f p_lidar;        ///< Metres.
  std::uint8_t reflectivity = 0;  ///< 0 to 150: Lambertian, 0 to 100 %; above: retroreflective.
  std::uint8_t tag = 0;           ///< Livox's tag: bits 1-0 hold 2 for a return merged at an edge.
  std::uint8_t line = 0;          ///< 0 to 5.
};

/// What was really there, point by point.
struct LidarTruth {
  Eigen::Vector3f p_lidar_stamp;  ///< The surface met by the beam's centre, in the lidar frame at
                                  ///< the scan's stamp: no noise, no motion.
  bool mixed = false;             ///< The return is a blend of surfaces at different ranges.
  bool moving = false;            ///< On an object that moves.
};

/// The returns of one scan period, in order of time; shots without a return are left out.
struct LidarScan {
  std::int64_t stamp_ns = 0;
  std::vector<LidarPoint> points;
  std::vector<LidarTruth> truth;  ///< One for each point.
};

/// One scan period to simulate.
struct ScanPeriod {
  std::int64_t stamp_ns = 0;  ///< On the simulation's clock; start of the period.
  std::int64_t duration_ns = 0;
  /// The lidar's pose at a time; called from several threads.
  std::function<geometry::SE3(double time_s)> T_world_lidar;
};

/// Simulates a Livox Horizon shot by shot: pattern, pointing noise, a beam with a width that can
/// meet two surfaces, detection that fades with range and reflectivity, range noise, drop-outs.
/// The same input gives the same bytes with any number of threads.
class LidarScanner {
 public:
  /// `shader` must outlive the scanner. Throws config::ConfigError.
  LidarScanner(const sensors::LidarModel& model, std::uint64_t seed, const SurfaceShader& shader);

  /// Moves the scene's objects through the period and scans on `threads` threads.
  [[nodiscard]] LidarScan scan(RayScene& scene, const ScanPeriod& period, int threads) const;

 private:
  struct Shot;
  struct Echo;
  void scan_shots(const RayScene& scene,
                  const ScanPeriod& period,
                  std::int64_t first,
                  LidarScan& part,
                  int count) const;
  [[nodiscard]] Echo strongest_echo(const RayScene& scene, const Ray* rays, const Hit* hits) const;

  sensors::LidarModel model_;
  std::uint64_t seed_;
  const SurfaceShader* shader_;
};

}  // namespace camvox::simulation
