#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"

namespace camvox::test {

/// A world of points that a camera recognises: what features, depth and matching come to, without
/// images. For tests of whatever works on features.
class FeatureWorld {
 public:
  struct Point {
    Eigen::Vector3d p_world;
    features::Descriptor descriptor;
  };

  static features::Descriptor random_descriptor(std::mt19937& random) {
    features::Descriptor descriptor;
    for (auto& byte : descriptor.bytes) byte = static_cast<std::uint8_t>(random());
    return descriptor;
  }

  explicit FeatureWorld(unsigned seed = 4) : random_(seed) {}
  /// What is added from here on differs from what another copy of this world gets.
  void reseed(unsigned seed) { random_.seed(seed); }

  /// `count` points in a box around `centre`, half as large as `extent`.
  void add_box(int count, const Eigen::Vector3d& centre, const Eigen::Vector3d& extent) {
    std::uniform_real_distribution<double> unit(-0.5, 0.5);
    for (int i = 0; i < count; ++i) {
      const Eigen::Vector3d offset(unit(random_), unit(random_), unit(random_));
      points_.push_back({centre + extent.cwiseProduct(offset), random_descriptor(random_)});
    }
  }

  /// These points.
  void add_points(const std::vector<Eigen::Vector3d>& points_world) {
    for (const auto& p_world : points_world) {
      points_.push_back({p_world, random_descriptor(random_)});
    }
  }

  /// The points again, moved: a place that looks the same.
  void add_copy(std::size_t first, std::size_t last, const geometry::SE3& T_copy_original) {
    for (std::size_t i = first; i < last; ++i) {
      points_.push_back({T_copy_original * points_[i].p_world, points_[i].descriptor});
    }
  }

  /// What a camera sees within `range_m`: half a pixel of noise, a tenth of the bits wrong, depth
  /// with 2 cm of noise on four features of five. `part` of the points is noticed, others each
  /// time.
  features::FrameFeatures look(const geometry::SE3& T_world_camera,
                               double range_m = 30.0,
                               double part = 1.0) {
    std::normal_distribution<double> unit;
    const geometry::SE3 T_camera_world = T_world_camera.inverse();
    features::FrameFeatures seen;
    for (const auto& point : points_) {
      const Eigen::Vector3d p = T_camera_world * point.p_world;
      if (p.z() < 0.5 || p.z() > range_m) continue;
      const double u_px = camera.fx_px * p.x() / p.z() + camera.cx_px + 0.5 * unit(random_);
      const double v_px = camera.fy_px * p.y() / p.z() + camera.cy_px + 0.5 * unit(random_);
      if (u_px < 0.0 || v_px < 0.0 || u_px > 2.0 * camera.cx_px || v_px > 2.0 * camera.cy_px)
        continue;
      if (part < 1.0 && static_cast<double>(random_() % 1000) >= 1000.0 * part) continue;
      const Eigen::Vector2f u(static_cast<float>(u_px), static_cast<float>(v_px));
      const bool has_depth = random_() % 5 != 0;
      seen.key_points.push_back({u.x(), u.y(), 0.0F, static_cast<float>(random_() % 100), 0});
      seen.undistorted_px.push_back(u);
      seen.descriptors.push_back(flip(point.descriptor));
      seen.depth_m.push_back(has_depth ? static_cast<float>(p.z() + 0.02 * unit(random_)) : 0.0F);
      seen.depth_sigma_m.push_back(has_depth ? 0.02F : 0.0F);
    }
    return seen;
  }

  [[nodiscard]] std::size_t size() const { return points_.size(); }

  optimization::PinholeCamera camera{500.0, 500.0, 400.0, 200.0, 0.05};

 private:
  features::Descriptor flip(features::Descriptor descriptor) {
    for (auto& byte : descriptor.bytes) {
      for (int bit = 0; bit < 8; ++bit) {
        if (random_() % 10 == 0) byte = static_cast<std::uint8_t>(byte ^ (1U << bit));
      }
    }
    return descriptor;
  }

  std::mt19937 random_;
  std::vector<Point> points_;
};

/// A camera on a circle in the x-z plane (y down), looking along it.
inline geometry::SE3 on_circle(double angle_rad, double radius_m) {
  return {geometry::SO3::exp({0.0, -angle_rad, 0.0}),
          Eigen::Vector3d(
              -radius_m + radius_m * std::cos(angle_rad), 0.0, radius_m * std::sin(angle_rad))};
}

}  // namespace camvox::test
