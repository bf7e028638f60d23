#include "camvox/simulation/route.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "camvox/simulation/random.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector2d;
using geometry::SE3;
using geometry::SO3;

constexpr double kKnot_s = 0.05;     ///< Distance of the spline's knots.
constexpr double kSpacing_m = 0.02;  ///< Distance of the points of a path.

/// The robot on the plane at one knot; yaw is not wrapped.
struct PlanarPose {
  Vector2d position;
  double yaw_rad;
};

/// The signed angle from a to b.
double angle_between(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

/// Points every kSpacing_m along a polygon whose corners are arcs.
std::vector<Vector2d> round_corners(const std::vector<Vector2d>& corners, double wanted_radius) {
  std::vector<Vector2d> path;
  const auto line_to = [&](const Vector2d& end) {
    const Vector2d start = path.back();
    const double length = (end - start).norm();
    const int steps = std::max(1, static_cast<int>(length / kSpacing_m));
    for (int i = 1; i <= steps; ++i) path.emplace_back(start + (end - start) * (i / double(steps)));
  };
  path.push_back(corners.front());
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Vector2d in = (corners[i] - corners[i - 1]).normalized();
    const Vector2d out = (corners[i + 1] - corners[i]).normalized();
    const double angle = angle_between(in, out);
    // Short sides get tighter arcs: an arc may take at most 45 % of each.
    const double side_length =
        std::min((corners[i] - corners[i - 1]).norm(), (corners[i + 1] - corners[i]).norm());
    const double slope = std::tan(0.5 * std::abs(angle));
    const double cut = std::min(wanted_radius * slope, 0.45 * side_length);
    const double radius = slope > 1e-9 ? cut / slope : 0.0;
    line_to(corners[i] - cut * in);
    const Vector2d side = std::copysign(1.0, angle) * Vector2d(-in.y(), in.x());
    const Vector2d centre = path.back() + radius * side;
    const Vector2d arm = path.back() - centre;
    const int steps = std::max(1, static_cast<int>(radius * std::abs(angle) / kSpacing_m));
    for (int s = 1; s <= steps; ++s) {
      path.emplace_back(centre + Eigen::Rotation2Dd(angle * s / steps) * arm);
    }
  }
  line_to(corners.back());
  return path;
}

/// The speed at every point of a path: limits of curves, then of acceleration from both ends.
std::vector<double> speed_profile(const std::vector<Vector2d>& path, const Drivetrain& robot) {
  const std::size_t count = path.size();
  std::vector<double> speed(count, robot.max_speed_m_s);
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const Vector2d in = path[i] - path[i - 1];
    const double turn = std::abs(angle_between(in, path[i + 1] - path[i]));
    const double curvature = turn / std::max(in.norm(), 1e-6);
    if (curvature < 1e-4) continue;
    speed[i] = std::min({speed[i],
                         robot.max_turn_rate_rad_s / curvature,
                         std::sqrt(robot.max_lateral_m_s2 / curvature)});
  }
  const auto limit = [&](std::size_t from, std::size_t to) {
    const double gain = 2.0 * robot.max_acceleration_m_s2 * (path[to] - path[from]).norm();
    speed[to] = std::min(speed[to], std::sqrt(speed[from] * speed[from] + gain));
  };
  speed.front() = speed.back() = 0.0;
  for (std::size_t i = 1; i < count; ++i) limit(i - 1, i);
  for (std::size_t i = count - 1; i > 0; --i) limit(i, i - 1);
  return speed;
}

/// Appends the legs of a route as poses at the knots.
class Planner {
 public:
  Planner(const Route& route, const Drivetrain& robot)
      : robot_(robot), poses_{{route.start_m, route.start_yaw_rad}} {}

  void operator()(const Pause& pause) {
    const PlanarPose here = poses_.back();
    const auto knots = static_cast<std::size_t>(std::ceil(pause.duration_s / kKnot_s));
    poses_.insert(poses_.end(), knots, here);
  }

  void operator()(const Turn& turn) {
    const PlanarPose start = poses_.back();
    // A cosine ramp: its peak rate is pi / 2 of the mean.
    const double duration = std::abs(turn.angle_rad) * 0.5 * M_PI / robot_.max_turn_rate_rad_s;
    const int knots = std::max(1, static_cast<int>(std::ceil(duration / kKnot_s)));
    for (int i = 1; i <= knots; ++i) {
      const double done = 0.5 - 0.5 * std::cos(M_PI * i / knots);
      poses_.push_back({start.position, start.yaw_rad + done * turn.angle_rad});
    }
  }

  void operator()(const Drive& drive) {
    std::vector<Vector2d> corners = {poses_.back().position};
    for (const Vector2d& waypoint : drive.waypoints_m) {
      if ((waypoint - corners.back()).norm() > 1e-3) corners.push_back(waypoint);
    }
    if (corners.size() < 2) return;
    // A wheeled robot cannot set off sideways: first turn towards the path.
    const double yaw_start = poses_.back().yaw_rad;
    const Vector2d facing(std::cos(yaw_start), std::sin(yaw_start));
    const double aside = angle_between(facing, corners[1] - corners[0]);
    if (std::abs(aside) > 0.01) (*this)(Turn{aside});
    const std::vector<Vector2d> path = round_corners(corners, drive.corner_radius_m);
    const std::vector<double> speed = speed_profile(path, robot_);
    double yaw = poses_.back().yaw_rad;
    double time = 0.0;
    double next_knot = kKnot_s;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const Vector2d step = path[i] - path[i - 1];
      const double duration = 2.0 * step.norm() / std::max(speed[i] + speed[i - 1], 1e-3);
      const Vector2d heading(std::cos(yaw), std::sin(yaw));
      yaw += angle_between(heading, step);
      for (; next_knot <= time + duration; next_knot += kKnot_s) {
        poses_.push_back({path[i - 1] + step * ((next_knot - time) / duration), yaw});
      }
      time += duration;
    }
    poses_.push_back({path.back(), yaw});
  }

  [[nodiscard]] const std::vector<PlanarPose>& poses() const { return poses_; }

 private:
  Drivetrain robot_;
  std::vector<PlanarPose> poses_;
};

/// A running mean over 2 reach + 1 knots: makes turn rates and accelerations continuous.
std::vector<PlanarPose> smooth(const std::vector<PlanarPose>& poses, int reach) {
  std::vector<PlanarPose> result;
  result.reserve(poses.size());
  const int last = static_cast<int>(poses.size()) - 1;
  for (int i = 0; i <= last; ++i) {
    PlanarPose mean{Vector2d::Zero(), 0.0};
    for (int k = i - reach; k <= i + reach; ++k) {
      const PlanarPose& pose = poses[static_cast<std::size_t>(std::clamp(k, 0, last))];
      mean.position += pose.position / (2 * reach + 1);
      mean.yaw_rad += pose.yaw_rad / (2 * reach + 1);
    }
    result.push_back(mean);
  }
  return result;
}

/// Height of the uneven ground: smooth noise of two wavelengths, 0.9 and 3.1 m.
double ground_height(const CounterRandom& random, const Vector2d& place) {
  double height = 0.0;
  for (const auto& [wavelength, weight] : {std::pair{0.9, 0.35}, std::pair{3.1, 1.0}}) {
    const double x = place.x() / wavelength;
    const double y = place.y() / wavelength;
    const auto lattice = [&](double i, double j) {
      const auto index = static_cast<std::uint64_t>(static_cast<std::int64_t>(i * 65536.0 + j));
      return random.normal(index, wavelength < 1.0 ? 0 : 1);
    };
    const auto fade = [](double t) { return t * t * t * (t * (6.0 * t - 15.0) + 10.0); };
    const double fx = fade(x - std::floor(x));
    const double fy = fade(y - std::floor(y));
    const double i = std::floor(x);
    const double j = std::floor(y);
    const double near = (1 - fx) * lattice(i, j) + fx * lattice(i + 1, j);
    const double far = (1 - fx) * lattice(i, j + 1) + fx * lattice(i + 1, j + 1);
    height += weight * ((1 - fy) * near + fy * far);
  }
  return height;
}

/// The body on the ground: the plane through the heights under the axles and the wheels.
SE3 stand_on_ground(const PlanarPose& pose, const CounterRandom& random, double bump_height_m) {
  constexpr double kHalfBase_m = 0.3;
  const Vector2d ahead(kHalfBase_m * std::cos(pose.yaw_rad), kHalfBase_m * std::sin(pose.yaw_rad));
  const Vector2d left(-ahead.y(), ahead.x());
  const auto height = [&](const Vector2d& offset) {
    return bump_height_m * ground_height(random, pose.position + offset);
  };
  const double front = height(ahead);
  const double rear = height(-ahead);
  const double port = height(left);
  const double starboard = height(-left);
  const double pitch = -std::atan2(front - rear, 2.0 * kHalfBase_m);
  const double roll = std::atan2(port - starboard, 2.0 * kHalfBase_m);
  const SO3 R = SO3::exp({0, 0, pose.yaw_rad}) * SO3::exp({0, pitch, 0}) * SO3::exp({roll, 0, 0});
  return {R, {pose.position.x(), pose.position.y(), 0.25 * (front + rear + port + starboard)}};
}

}  // namespace

Trajectory plan_route(const Route& route, const Drivetrain& robot) {
  if (route.legs.empty()) throw std::logic_error("plan_route: no legs");
  Planner planner(route, robot);
  for (const RouteLeg& leg : route.legs) std::visit(planner, leg);
  const std::vector<PlanarPose> poses = smooth(smooth(planner.poses(), 4), 4);
  const CounterRandom random(robot.ground_seed, 300);
  std::vector<SE3> control;
  control.reserve(poses.size());
  for (const PlanarPose& pose : poses) {
    control.push_back(stand_on_ground(pose, random, robot.bump_height_m));
  }
  return {control, kKnot_s};
}

}  // namespace camvox::simulation
