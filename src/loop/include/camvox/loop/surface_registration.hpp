#pragma once

#include <cstdint>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/loop/surface_map.hpp"

namespace camvox::loop {

/// Tuning of register_surfaces(). YAML keys are the field names.
struct RegistrationConfig {
  int starts = 3;                 ///< Best ones of the search that are refined.
  int max_iterations = 15;        ///< Of the refinement.
  double plane_sigma_m = 0.05;    ///< Of a point's distance from a plane that is its own.
  double point_sigma_m = 0.15;    ///< Of its distance from the nearest point of rough surfaces.
  double repeated_points = 30.0;  ///< So many points err together.
  double min_distinction = 0.14;  ///< See Registration.
  double max_runner_up = 0.6;     ///< Part of it that another pose may have.
  double max_rotation_sigma_deg = 0.5;    ///< A pose less certain than this is none.
  double max_translation_sigma_m = 0.25;  ///< The same.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("starts", self.starts, config::at_least(1), config::at_most(50));
    field("max_iterations", self.max_iterations, config::at_least(1), config::at_most(1000));
    field("plane_sigma_m", self.plane_sigma_m, positive);
    field("point_sigma_m", self.point_sigma_m, positive);
    field("repeated_points", self.repeated_points, config::at_least(1.0));
    field("min_distinction", self.min_distinction, config::at_least(0.0), config::at_most(1.0));
    field("max_runner_up", self.max_runner_up, positive, config::at_most(1.0));
    field("max_rotation_sigma_deg", self.max_rotation_sigma_deg, positive);
    field("max_translation_sigma_m", self.max_translation_sigma_m, positive);
  }
};

enum class RegistrationStatus : std::uint8_t {
  kOk,
  kNothing,      ///< Too little stands there.
  kNotDistinct,  ///< Things coincide hardly better than elsewhere: perhaps another place.
  kUncertain,    ///< The pose is not determined well enough, as along a corridor.
};

struct Registration {
  RegistrationStatus status = RegistrationStatus::kNothing;
  geometry::SE3 T_target_source;
  geometry::Matrix6d covariance_source = geometry::Matrix6d::Zero();  ///< T_target_source*exp(xi)
  /// How much more of what is no plane (trees, posts, edges, cars) coincides with the other one's
  /// than it does 1.5 m beside the pose, on whatever side. Planes say nothing: ground and facades
  /// are everywhere.
  double distinction = 0.0;
  double runner_up = 0.0;  ///< Distinction of the best pose elsewhere.
  int points = 0;          ///< With a counterpart.
};

/// Where the search begins and how far it goes.
struct RegistrationStart {
  geometry::SE3 T_target_source;
  double search_m = 5.0;
  double search_yaw_rad = 0.15;
};

/// The pose of one place's surroundings in another's, from what stands there. Search over the
/// ground plane; of the best starts, refinement of distances from planes (Chen, Medioni, 1992) and,
/// where it is rough, from points. Deterministic.
[[nodiscard]] Registration register_surfaces(const SurfaceMap& source,
                                             const SurfaceMap& target,
                                             const RegistrationStart& start,
                                             const RegistrationConfig& config);

}  // namespace camvox::loop
