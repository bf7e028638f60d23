#pragma once

#include <cstdint>
#include <optional>

#include "camvox/geometry/se3.hpp"

namespace camvox::tracking {

/// Where the camera goes next: translation at constant velocity, rotation from the gyro when there
/// is one, else at constant rate.
class MotionModel {
 public:
  /// The camera moved so between two tracked frames `dt_s` > 0 apart.
  void observe(const geometry::SE3& T_previous_camera, double dt_s);
  void reset() { twist_.reset(); }

  /// Motion over the next `dt_s`: the pose of the next camera in the present one.
  [[nodiscard]] geometry::SE3 predict(
      double dt_s, const std::optional<geometry::SO3>& R_present_next = std::nullopt) const;

  [[nodiscard]] bool is_known() const { return twist_.has_value(); }
  /// [angular; linear] velocity in camera axes; zero while unknown.
  [[nodiscard]] geometry::Vector6d twist_camera() const {
    return twist_.value_or(geometry::Vector6d::Zero());
  }

 private:
  std::optional<geometry::Vector6d> twist_;
};

}  // namespace camvox::tracking
