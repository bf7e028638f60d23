#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <variant>
#include <vector>

#include "camvox/simulation/trajectory.hpp"

namespace camvox::simulation {

/// Drive along straight lines with rounded corners; starts (after a turn towards the first way
/// point, if need be) and ends at rest. Corners of short sides are tighter than asked for.
struct Drive {
  std::vector<Eigen::Vector2d> waypoints_m;
  double corner_radius_m = 2.5;
};
/// Stand still.
struct Pause {
  double duration_s;
};
/// Turn on the spot, counter-clockwise positive.
struct Turn {
  double angle_rad;
};
using RouteLeg = std::variant<Drive, Pause, Turn>;

/// What a wheeled robot does, leg after leg; each leg starts where the one before ended.
struct Route {
  Eigen::Vector2d start_m = Eigen::Vector2d::Zero();
  double start_yaw_rad = 0.0;
  std::vector<RouteLeg> legs;
};

/// What the robot and its ground are like.
struct Drivetrain {
  double max_speed_m_s = 2.0;
  double max_acceleration_m_s2 = 0.7;  ///< Along the path.
  double max_lateral_m_s2 = 1.2;       ///< In curves.
  double max_turn_rate_rad_s = 1.0;
  double bump_height_m = 0.006;  ///< Unevenness of the ground, one sigma; shakes the body.
  std::uint64_t ground_seed = 1;
};

/// The smooth motion of a wheeled robot along a route: speed limited by acceleration and curves,
/// heave, pitch and roll from an uneven ground that is the same on every visit.
/// Throws std::logic_error for a route without legs.
[[nodiscard]] Trajectory plan_route(const Route& route, const Drivetrain& robot);

}  // namespace camvox::simulation
