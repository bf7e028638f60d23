#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"

namespace camvox::loop {

/// Tuning of gather(). YAML keys are the field names.
struct SurroundingsConfig {
  double reach_m = 25.0;      ///< Path before and after a place that is looked around from.
  double max_range_m = 20.0;  ///< Surfaces farther from the place are left out.
  double max_height_m = 6.0;  ///< The same, above the camera.
  double grain_m = 0.3;       ///< One point stands for all that fall in a cube of this size.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("reach_m", self.reach_m, config::greater_than(0.0));
    field("max_range_m", self.max_range_m, config::at_least(5.0), config::at_most(60.0));
    field("max_height_m", self.max_height_m, config::greater_than(0.0));
    field("grain_m", self.grain_m, config::at_least(0.05), config::at_most(2.0));
  }
};

/// What features with depth up to `max_depth_m` show of the surfaces around, in their camera frame.
[[nodiscard]] std::vector<Eigen::Vector3f> surface_points(const features::FrameFeatures& features,
                                                          const optimization::PinholeCamera& camera,
                                                          double max_depth_m);

/// Points on surfaces that were measured from one pose.
struct SurfaceView {
  std::span<const Eigen::Vector3f> points_camera;
  geometry::SE3 T_place_camera;
};

/// What stands around a place, from all sides from which it was passed. The level frame has its
/// origin in the place's camera, z up, x to where the camera looks.
struct Surroundings {
  geometry::SE3 T_place_level;
  std::vector<Eigen::Vector3f> points_level;
};

/// Puts together what was seen from poses along the path past a place; the place's own view is
/// `views[centre]`, the others stand in the order of the path. Up is perpendicular to the path, and
/// otherwise where the cameras' tops point to on average.
[[nodiscard]] Surroundings gather(std::span<const SurfaceView> views,
                                  std::size_t centre,
                                  const SurroundingsConfig& config);

/// One mean point for each occupied cube of a grid, in the order of the cubes.
[[nodiscard]] std::vector<Eigen::Vector3f> thin(std::span<const Eigen::Vector3f> points,
                                                double grain_m);

}  // namespace camvox::loop
