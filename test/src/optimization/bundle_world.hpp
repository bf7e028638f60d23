#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "camvox/optimization/bundle_adjustment.hpp"

namespace camvox::optimization {

/// Points along a street, seen by a camera that drives through it; truth and noisy measurements.
struct BundleWorld {
  std::vector<geometry::SE3> T_world_camera;
  std::vector<Eigen::Vector3d> points_world;
  BundleProblem problem;  ///< Starts off the truth by `start_noise`.
};

struct BundleWorldOptions {
  int free_poses = 8;
  int fixed_poses = 2;
  int points = 400;
  double spacing_m = 1.0;
  double noise_sigmas = 1.0;  ///< 0: exact observations.
  double start_noise = 0.02;  ///< rad and m, of poses; five times that of points.
  int min_views = 3;          ///< Points seen less often are not in the problem.
};

inline BundleWorld make_bundle_world(const BundleWorldOptions& options, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  BundleWorld world;
  world.problem.camera = {700.0, 710.0, 620.0, 187.0, 0.05};
  const auto& camera = world.problem.camera;
  const int poses = options.free_poses + options.fixed_poses;
  for (int i = 0; i < poses; ++i) {
    const Eigen::Vector3d w(0.02 * normal(random), 0.05 * normal(random), 0.01 * normal(random));
    world.T_world_camera.emplace_back(
        geometry::SO3::exp(w), Eigen::Vector3d(0.1 * normal(random), 0.0, options.spacing_m * i));
  }
  for (int j = 0; j < options.points; ++j) {
    world.points_world.emplace_back(
        10.0 * unit(random),
        3.0 * unit(random),
        8.0 + 4.0 * unit(random) + 0.5 * options.spacing_m * poses * (1.0 + unit(random)));
  }
  for (std::uint32_t j = 0; j < world.points_world.size(); ++j) {
    std::vector<BundleObservation> views;
    for (std::uint32_t i = 0; i < world.T_world_camera.size(); ++i) {
      const Eigen::Vector3d p_camera = world.T_world_camera[i].inverse() * world.points_world[j];
      if (p_camera.z() < 2.0 || p_camera.z() > 25.0) continue;
      const double u = camera.fx_px * p_camera.x() / p_camera.z() + camera.cx_px;
      const double v = camera.fy_px * p_camera.y() / p_camera.z() + camera.cy_px;
      if (u < 0.0 || u > 1240.0 || v < 0.0 || v > 375.0) continue;
      BundleObservation seen{.pose = i, .point = j, .observation = {}};
      seen.observation.u_px = {u + options.noise_sigmas * normal(random),
                               v + options.noise_sigmas * normal(random)};
      seen.observation.sigma_depth_m = 0.03;
      const double depth = p_camera.z() + 0.03 * options.noise_sigmas * normal(random);
      if (j % 3 != 0) seen.observation.depth_m = depth;  // a third has no depth
      views.push_back(seen);
    }
    if (static_cast<int>(views.size()) < options.min_views) continue;
    world.problem.observations.insert(world.problem.observations.end(), views.begin(), views.end());
  }
  for (int i = 0; i < poses; ++i) {
    geometry::Vector6d xi = geometry::Vector6d::Zero();
    const bool fixed = i < options.fixed_poses;
    if (!fixed) {
      for (auto& value : xi) value = options.start_noise * normal(random);
    }
    world.problem.poses.push_back(
        {geometry::retract(world.T_world_camera[static_cast<std::size_t>(i)], xi), fixed});
  }
  for (const auto& p : world.points_world) {
    const Eigen::Vector3d off(normal(random), normal(random), normal(random));
    world.problem.points_world.push_back(p + 5.0 * options.start_noise * off);
  }
  return world;
}

/// The largest distance of a pose from the truth, m.
inline double worst_position_m(const BundleWorld& world) {
  double worst = 0.0;
  for (std::size_t i = 0; i < world.T_world_camera.size(); ++i) {
    worst = std::max(worst,
                     (world.problem.poses[i].T_world_camera.translation() -
                      world.T_world_camera[i].translation())
                         .norm());
  }
  return worst;
}

}  // namespace camvox::optimization
