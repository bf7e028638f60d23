#pragma once

#include <optional>

#include "camvox/geometry/se3.hpp"

namespace camvox::tracking {

/// What carries a camera cannot accelerate it at will. A pose that would take more is wrong,
/// however many features agree on it: they sit on something else that moves, such as a car that
/// fills the picture. The longer ago the last pose is, the more is possible.
class MotionLimit {
 public:
  /// Mean acceleration over the time between two frames, m/s^2; 0: no limit.
  explicit MotionLimit(double max_acceleration_mps2);

  /// The camera moved so between two accepted poses, `dt_s` > 0 apart.
  void observe(const geometry::SE3& T_last_camera, double dt_s);
  /// The next pose may be anywhere, e.g. after relocalisation.
  void forget() { velocity_mps_.reset(); }
  /// Whether it can refuse anything.
  [[nodiscard]] bool knows_velocity() const { return velocity_mps_.has_value(); }

  /// Whether the camera may have moved so within `dt_s` after the last accepted pose, of which
  /// `sigma_m` is the standard deviation. True while the velocity is not known.
  [[nodiscard]] bool allows(const geometry::SE3& T_last_camera, double dt_s, double sigma_m) const;

 private:
  double max_acceleration_mps2_;
  std::optional<Eigen::Vector3d> velocity_mps_;  ///< In axes of the last camera: mean over over_s_.
  double over_s_ = 0.0;
};

}  // namespace camvox::tracking
