#pragma once

#include <Eigen/Core>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::simulation {

/// Position, attitude and their exact first and second derivatives at one moment.
struct KinematicState {
  geometry::SE3 T_world_body;
  Eigen::Vector3d v_world = Eigen::Vector3d::Zero();     ///< m/s
  Eigen::Vector3d a_world = Eigen::Vector3d::Zero();     ///< m/s^2, without gravity
  Eigen::Vector3d omega_body = Eigen::Vector3d::Zero();  ///< rad/s
  Eigen::Vector3d alpha_body = Eigen::Vector3d::Zero();  ///< rad/s^2
};

/// A smooth motion: cubic B-splines of the position and, cumulative, of the rotation, with knots
/// at equal distances in time. Position and rotation are twice continuously differentiable, so
/// that an ideal IMU's signals are continuous. The spline passes near its control poses, not
/// through them: it, not they, is the truth.
///
/// Source of the rotation's derivatives: Sommer, Usenko, Schubert, Demmel, Cremers, "Efficient
/// derivative computation for cumulative B-splines on Lie groups", CVPR 2020.
class Trajectory {
 public:
  /// The first control pose is near time 0, the next ones `knot_interval_s` apart. Throws
  /// std::logic_error with no control pose or an interval that is not above 0.
  Trajectory(const std::vector<geometry::SE3>& T_world_body, double knot_interval_s);

  /// The state at a time; before the start and after the end the body stands still.
  [[nodiscard]] KinematicState state(double time_s) const;
  /// The pose alone, for half the price.
  [[nodiscard]] geometry::SE3 pose(double time_s) const;

  [[nodiscard]] double duration_s() const { return duration_s_; }

 private:
  /// The segment of a time, and the position in it, 0 to 1.
  struct Place {
    std::size_t segment;
    double u;
  };
  [[nodiscard]] Place place(double time_s) const;

  double knot_interval_s_;
  double duration_s_;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<geometry::SO3> rotations_;
  std::vector<Eigen::Vector3d> turns_;  ///< log(R_i^-1 R_i+1)
};

/// A pose with its time, as a recorded trajectory has it.
struct TimedPose {
  double time_s;
  geometry::SE3 T_world_body;
};

/// A smooth motion near the given poses, starting at time 0: interpolated at `knot_interval_s`,
/// then taken as control poses. Throws std::logic_error for fewer than two poses or times that
/// do not increase.
[[nodiscard]] Trajectory follow_poses(const std::vector<TimedPose>& poses, double knot_interval_s);

}  // namespace camvox::simulation
