#pragma once

#include <algorithm>
#include <cstddef>
#include <numbers>

#include "camvox/test/feature_world.hpp"
#include "camvox/test/surface_scene.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::test {

/// A robot that drives along a street and back on its other side. On the way back the images show
/// other features, of the same surfaces. Odometry turns a little and measures too long.
class ThereAndBack {
 public:
  static constexpr double kLength_m = 60.0;
  static constexpr double kStep_m = 2.0;
  static constexpr std::size_t kSteps = static_cast<std::size_t>(kLength_m / kStep_m);
  static constexpr std::size_t kKeyframes = 2 * kSteps;
  static constexpr double kPart = 0.3;  ///< Of the points in sight that become features.

  explicit ThereAndBack(const SurfaceScene& scene) : back_(5) {
    there_.add_points(scene.sample(1));
    back_.add_points(scene.sample(2));
  }

  /// Keyframe `i` looks along x on the way there, and the other way on the way back.
  static geometry::SE3 truth(std::size_t i) {
    using geometry::SE3;
    using geometry::SO3;
    Eigen::Matrix3d R;
    R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const SE3 T_level_camera(SO3::from_matrix(R), Eigen::Vector3d::Zero());
    const double s = kStep_m * static_cast<double>(i);
    if (!is_back(i)) return SE3(SO3(), {s, -1.0, 0.0}) * T_level_camera;
    return SE3(SO3::exp({0.0, 0.0, std::numbers::pi}), {2.0 * kLength_m - s, 1.0, 0.0}) *
           T_level_camera;
  }

  /// Number `i`, with id i + 1. `T_map_last`: where the map has the one before.
  tracking::Keyframe keyframe(std::size_t i, const geometry::SE3& T_map_last) {
    tracking::Keyframe keyframe;
    keyframe.id = i + 1;
    keyframe.frame_id = 10 * (i + 1);
    keyframe.parent_id = i;
    keyframe.features = (is_back(i) ? back_ : there_).look(truth(i), 30.0, kPart);
    keyframe.landmark_ids.assign(keyframe.features.size(), 0);
    keyframe.T_map_camera = truth(i);
    if (i == 0) return keyframe;
    const auto step = truth(i - 1).inverse() * truth(i);
    const geometry::SE3 wrong(geometry::SO3::exp({0.0, drift_rad, 0.0}),
                              10.0 * drift_rad * step.translation());
    keyframe.T_map_camera = T_map_last * step * wrong;
    return keyframe;
  }

  /// The first older keyframe that sees in part what `i` sees.
  static std::size_t first_neighbour(std::size_t i) {
    const std::size_t first = i > 15 ? i - 15 : 0;
    return is_back(i) ? std::max(first, kSteps + 1) : first;
  }

  [[nodiscard]] const optimization::PinholeCamera& camera() const { return there_.camera; }

  double drift_rad = 7e-4;

 private:
  static bool is_back(std::size_t i) { return i > kSteps; }

  FeatureWorld there_;
  FeatureWorld back_;
};

}  // namespace camvox::test
