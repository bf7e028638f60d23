#include "camvox/simulation/trajectory.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace camvox::simulation {
namespace {

using Eigen::Vector3d;
using geometry::SE3;
using geometry::SO3;

/// Cumulative basis of the uniform cubic B-spline at u, with derivatives in u. The first function
/// is the constant 1.
struct CumulativeBasis {
  Vector3d value;
  Vector3d first;
  Vector3d second;

  explicit CumulativeBasis(double u) {
    const double u2 = u * u;
    const double u3 = u2 * u;
    value = Vector3d(5 + 3 * u - 3 * u2 + u3, 1 + 3 * u + 3 * u2 - 2 * u3, u3) / 6.0;
    first = Vector3d(3 - 6 * u + 3 * u2, 3 + 6 * u - 6 * u2, 3 * u2) / 6.0;
    second = Vector3d(-6 + 6 * u, 6 - 12 * u, 6 * u) / 6.0;
  }
};

}  // namespace

Trajectory::Trajectory(const std::vector<SE3>& T_world_body, double knot_interval_s)
    : knot_interval_s_(knot_interval_s) {
  if (T_world_body.empty()) throw std::logic_error("Trajectory: no control poses");
  if (!(knot_interval_s > 0.0)) throw std::logic_error("Trajectory: knot interval must be > 0");
  duration_s_ = knot_interval_s * static_cast<double>(T_world_body.size() - 1);
  // Three copies of the ends: the motion begins and ends at rest.
  const auto last = static_cast<std::ptrdiff_t>(T_world_body.size()) - 1;
  for (std::ptrdiff_t i = -3; i <= last + 3; ++i) {
    const SE3& T = T_world_body[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
    positions_.push_back(T.translation());
    rotations_.push_back(T.rotation());
  }
  for (std::size_t i = 0; i + 1 < rotations_.size(); ++i) {
    turns_.push_back((rotations_[i].inverse() * rotations_[i + 1]).log());
  }
}

Trajectory::Place Trajectory::place(double time_s) const {
  const double inside =
      std::clamp(time_s, -2.0 * knot_interval_s_, duration_s_ + 2.0 * knot_interval_s_);
  // Control pose k of the input has index k + 3 and its spline's middle at time k.
  const double knots = inside / knot_interval_s_ + 2.0;
  const auto segment = std::min(static_cast<std::size_t>(knots), positions_.size() - 4);
  return {segment, knots - static_cast<double>(segment)};
}

KinematicState Trajectory::state(double time_s) const {
  const auto [segment, u] = place(time_s);
  const CumulativeBasis basis(u);
  const double rate = 1.0 / knot_interval_s_;
  KinematicState state;
  Vector3d position = positions_[segment];
  SO3 R = rotations_[segment];
  for (int j = 0; j < 3; ++j) {
    const std::size_t k = segment + static_cast<std::size_t>(j);
    const Vector3d step = positions_[k + 1] - positions_[k];
    position += basis.value[j] * step;
    state.v_world += rate * basis.first[j] * step;
    state.a_world += rate * rate * basis.second[j] * step;
    const Vector3d& turn = turns_[k];
    const SO3 A = SO3::exp(basis.value[j] * turn);
    const double speed = rate * basis.first[j];
    R = R * A;
    // Sommer et al., eq. (17) and (19): carry over to the new frame, add this factor's own.
    state.omega_body = A.inverse() * state.omega_body + speed * turn;
    state.alpha_body = A.inverse() * state.alpha_body + speed * state.omega_body.cross(turn) +
                       rate * rate * basis.second[j] * turn;
  }
  state.T_world_body = {R, position};
  return state;
}

SE3 Trajectory::pose(double time_s) const {
  const auto [segment, u] = place(time_s);
  const CumulativeBasis basis(u);
  Vector3d position = positions_[segment];
  SO3 R = rotations_[segment];
  for (int j = 0; j < 3; ++j) {
    const std::size_t k = segment + static_cast<std::size_t>(j);
    position += basis.value[j] * (positions_[k + 1] - positions_[k]);
    R = R * SO3::exp(basis.value[j] * turns_[k]);
  }
  return {R, position};
}

Trajectory follow_poses(const std::vector<TimedPose>& poses, double knot_interval_s) {
  if (poses.size() < 2) throw std::logic_error("follow_poses: needs at least two poses");
  const auto later = [](const TimedPose& a, const TimedPose& b) { return !(a.time_s < b.time_s); };
  if (std::adjacent_find(poses.begin(), poses.end(), later) != poses.end()) {
    throw std::logic_error("follow_poses: times must increase");
  }
  std::vector<SE3> control;
  std::size_t next = 1;
  const double start_s = poses.front().time_s;
  for (std::size_t knot = 0;; ++knot) {
    const double time_s = start_s + knot_interval_s * static_cast<double>(knot);
    if (time_s > poses.back().time_s) break;
    while (poses[next].time_s < time_s) ++next;
    const TimedPose& before = poses[next - 1];
    const TimedPose& after = poses[next];
    const double ratio = (time_s - before.time_s) / (after.time_s - before.time_s);
    control.push_back(geometry::interpolate(before.T_world_body, after.T_world_body, ratio));
  }
  return {control, knot_interval_s};
}

}  // namespace camvox::simulation
