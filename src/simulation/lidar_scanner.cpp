#include "camvox/simulation/lidar_scanner.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "camvox/simulation/random.hpp"
#include "camvox/simulation/scan_pattern.hpp"
#include "parallel.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using geometry::SE3;

constexpr std::uint64_t kShotStream = 10;
/// What the numbers of a shot are drawn for: the channel of its random numbers.
enum Draw : std::uint64_t {
  kAzimuth = 0,
  kElevation = 1,
  kRange = 2,
  kDrop = 6,
  kDetection = 7,
  kEcho = 8
};

constexpr int kShotsPerPart = 480;  ///< Work unit of a thread.
constexpr double kDegree = std::numbers::pi / 180.0;

/// The beam's profile: centre, above, below, left, right, with their shares of the power. At half
/// of the divergence's half-width the Gaussian has lost half a sigma's worth.
struct SubBeam {
  double across;  ///< In half-widths of the divergence.
  double along;
  float power;
};
constexpr SubBeam kSubBeams[] = {{0.0, 0.0, 0.36f},
                                 {0.0, 0.9, 0.16f},
                                 {0.0, -0.9, 0.16f},
                                 {0.9, 0.0, 0.16f},
                                 {-0.9, 0.0, 0.16f}};
constexpr std::size_t kSubBeamCount = std::size(kSubBeams);

constexpr std::uint8_t kTagEdge = 0x02;  ///< Spatial noise, moderate confidence.

}  // namespace

/// The light that came back from surfaces too near to each other in range to tell apart.
struct LidarScanner::Echo {
  float strength = 0.0f;      ///< In units of the detection limit.
  float range_m = 0.0f;       ///< Mean, weighted by strength.
  bool mixed = false;         ///< Its parts do not lie on one plane.
  float reflectivity = 0.0f;  ///< Mean, weighted by strength.
  bool retroreflective = false;
};

LidarScanner::LidarScanner(const sensors::LidarModel& model,
                           std::uint64_t seed,
                           const SurfaceShader& shader)
    : model_(model), seed_(seed), shader_(&shader) {
  config::require_valid(model, "lidar");
}

LidarScan LidarScanner::scan(RayScene& scene, const ScanPeriod& period, int threads) const {
  const double start_s = static_cast<double>(period.stamp_ns) * 1e-9;
  scene.set_interval(start_s, start_s + static_cast<double>(period.duration_ns) * 1e-9);
  // Shots fall on whole multiples of the interval since time 0.
  const std::int64_t interval = model_.point_interval_ns;
  const std::int64_t first = (period.stamp_ns + interval - 1) / interval;
  const std::int64_t end = (period.stamp_ns + period.duration_ns + interval - 1) / interval;
  const auto parts = static_cast<int>((end - first + kShotsPerPart - 1) / kShotsPerPart);
  std::vector<LidarScan> results(static_cast<std::size_t>(parts));
  parallel_for(parts, threads, [&](int part) {
    const std::int64_t part_first = first + part * std::int64_t{kShotsPerPart};
    const auto count = static_cast<int>(std::min<std::int64_t>(kShotsPerPart, end - part_first));
    scan_shots(scene, period, part_first, results[static_cast<std::size_t>(part)], count);
  });
  LidarScan scan;
  scan.stamp_ns = period.stamp_ns;
  for (const LidarScan& part : results) {
    scan.points.insert(scan.points.end(), part.points.begin(), part.points.end());
    scan.truth.insert(scan.truth.end(), part.truth.begin(), part.truth.end());
  }
  return scan;
}

void LidarScanner::scan_shots(const RayScene& scene,
                              const ScanPeriod& period,
                              std::int64_t first,
                              LidarScan& part,
                              int count) const {
  const CounterRandom random(seed_, kShotStream);
  const double angle_sigma = model_.angle_sigma_deg * kDegree;
  const double half_width = 0.5 * model_.beam_width_deg * kDegree;
  const double half_height = 0.5 * model_.beam_height_deg * kDegree;
  std::vector<Ray> rays;
  std::vector<SE3> poses;
  for (int i = 0; i < count; ++i) {
    const std::int64_t shot = first + i;
    const auto index = static_cast<std::uint64_t>(shot);
    const std::int64_t time_ns = shot * model_.point_interval_ns;
    const float time =
        static_cast<float>(time_ns - period.stamp_ns) / static_cast<float>(period.duration_ns);
    poses.push_back(period.T_world_lidar(static_cast<double>(time_ns) * 1e-9));
    HorizonPattern::Direction aim =
        HorizonPattern::direction(shot, model_.point_interval_ns, model_.lines);
    aim.azimuth_rad += angle_sigma * random.normal(index, kAzimuth);
    aim.elevation_rad += angle_sigma * random.normal(index, kElevation);
    for (const SubBeam& sub : kSubBeams) {
      const Vector3d f_lidar = HorizonPattern::bearing(
          {aim.azimuth_rad + sub.across * half_width, aim.elevation_rad + sub.along * half_height});
      rays.push_back({poses.back().translation().cast<float>(),
                      (poses.back().rotation() * f_lidar).cast<float>(),
                      time});
    }
  }
  std::vector<Hit> hits(rays.size());
  scene.intersect(rays, hits);
  const SE3 T_stamp_world =
      period.T_world_lidar(static_cast<double>(period.stamp_ns) * 1e-9).inverse();
  for (int i = 0; i < count; ++i) {
    const std::int64_t shot = first + i;
    const auto index = static_cast<std::uint64_t>(shot);
    const std::size_t ray = static_cast<std::size_t>(i) * kSubBeamCount;
    const Echo echo = strongest_echo(scene, &rays[ray], &hits[ray]);
    // Near the limit of detection the chance of a return falls smoothly from one to none.
    const double chance =
        1.0 / (1.0 + std::exp(-12.0 * (static_cast<double>(echo.strength) - 1.0)));
    if (echo.strength <= 0.0f || random.uniform(index, kDetection) > chance) continue;
    if (random.uniform(index, kDrop) < model_.drop_probability) continue;
    const double range_m = echo.range_m + model_.range_sigma_m * random.normal(index, kRange);
    if (range_m < model_.min_range_m) continue;
    // The device believes that it pointed where the pattern says.
    const Vector3d f_lidar = HorizonPattern::bearing(
        HorizonPattern::direction(shot, model_.point_interval_ns, model_.lines));
    LidarPoint point;
    point.offset_ns = static_cast<std::uint32_t>(shot * model_.point_interval_ns - period.stamp_ns);
    point.p_lidar = ((range_m * f_lidar * 1000.0).array().round() / 1000.0).matrix().cast<float>();
    const float noisy = echo.reflectivity * (1.0f + 0.03f * random.fast_normal(index, kEcho));
    const float scale = echo.retroreflective ? 255.0f : 150.0f;
    point.reflectivity = static_cast<std::uint8_t>(
        std::clamp(noisy * scale, 0.0f, echo.retroreflective ? 255.0f : 150.0f));
    point.tag = echo.mixed ? kTagEdge : 0;
    point.line = static_cast<std::uint8_t>(shot % model_.lines);
    part.points.push_back(point);
    const float centre = hits[ray].found() ? hits[ray].distance : echo.range_m;
    const Vector3f p_world = rays[ray].origin_world + centre * rays[ray].direction_world;
    part.truth.push_back(
        {(T_stamp_world * p_world.cast<double>()).cast<float>(), echo.mixed, hits[ray].object > 0});
  }
}

LidarScanner::Echo LidarScanner::strongest_echo(const RayScene& scene,
                                                const Ray* rays,
                                                const Hit* hits) const {
  struct Part {
    float range_m;
    float strength;
    float reflectivity;
    bool retroreflective;
    Vector3f p_world;
    Vector3f normal_world;
  };
  std::array<Part, kSubBeamCount> parts;  // In order of range.
  std::size_t count = 0;
  // Strength 1 is a surface of reference reflectivity that faces the beam at maximum range.
  const auto limit =
      static_cast<float>(model_.max_range_m * model_.max_range_m / model_.reference_reflectivity);
  for (std::size_t i = 0; i < kSubBeamCount; ++i) {
    if (!hits[i].found() || hits[i].distance < 0.05f) continue;
    const Surface surface = scene.surface(hits[i]);
    const float range = hits[i].distance;
    const float facing = std::abs(surface.normal_world.dot(rays[i].direction_world));
    const float reflectivity = shader_->reflectivity(surface, 0.002f * range);
    // A retroreflector sends the light back some hundred times brighter, at any angle.
    const bool retro = surface.material->retroreflective;
    const float back = retro ? 50.0f * reflectivity : reflectivity * facing;
    std::size_t place = count++;
    for (; place > 0 && parts[place - 1].range_m > range; --place) parts[place] = parts[place - 1];
    parts[place] = {range,
                    kSubBeams[i].power * back * limit / (range * range),
                    reflectivity,
                    retro,
                    rays[i].origin_world + range * rays[i].direction_world,
                    surface.normal_world};
  }
  // Farther off the plane of the nearest part than the range noise would explain.
  const auto off_plane_m = static_cast<float>(std::max(4.0 * model_.range_sigma_m, 0.02));
  Echo best;
  for (std::size_t begin = 0; begin < count;) {
    Echo echo;
    float range_sum = 0.0f;
    float reflectivity_sum = 0.0f;
    std::size_t end = begin;
    for (; end < count &&
           parts[end].range_m - parts[begin].range_m <= static_cast<float>(model_.pulse_length_m);
         ++end) {
      echo.strength += parts[end].strength;
      range_sum += parts[end].strength * parts[end].range_m;
      reflectivity_sum += parts[end].strength * parts[end].reflectivity;
      echo.retroreflective |= parts[end].retroreflective;
    }
    if (echo.strength > best.strength) {
      best = echo;
      best.range_m = range_sum / echo.strength;
      best.reflectivity = reflectivity_sum / echo.strength;
      const Part& near = parts[begin];
      best.mixed = std::any_of(&parts[begin], &parts[begin] + (end - begin), [&](const Part& part) {
        return std::abs(near.normal_world.dot(part.p_world - near.p_world)) > off_plane_m;
      });
    }
    begin = end;
  }
  return best;
}

}  // namespace camvox::simulation
