#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::test {

/// Points around a camera, with their looks, and the features that a camera among them would see:
/// a world without images, exact where no noise is asked for. World axes are those of the body at
/// its start: x forward, y left, z up.
class TunnelWorld {
 public:
  struct View {
    double noise_px = 0.5;
    double noise_depth_m = 0.02;
    double max_depth_m = 60.0;  ///< 0: no depth at all.
    int max_features = 800;
  };

  /// Points within a box of `half_length_m` fore and aft, 15 m left and right and 5 m up and down,
  /// none within 3 m of the way along x.
  explicit TunnelWorld(unsigned seed = 1, double half_length_m = 80.0, int points = 12000)
      : random_(seed) {
    camera_.pinhole = {500.0, 500.0, 320.0, 240.0, 0.05};
    camera_.width_px = 640;
    camera_.height_px = 480;
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    while (static_cast<int>(points_.size()) < points) {
      Point point;
      point.p_world = {half_length_m * unit(random_), 15.0 * unit(random_), 5.0 * unit(random_)};
      if (std::hypot(point.p_world.y(), point.p_world.z()) < 3.0) continue;
      point.max_distance_m = 8.0F + 40.0F * static_cast<float>(std::abs(unit(random_)));
      point.angle_rad = 3.0F + 3.0F * static_cast<float>(unit(random_));
      for (auto& byte : point.descriptor.bytes) byte = static_cast<std::uint8_t>(random_());
      points_.push_back(point);
    }
  }

  [[nodiscard]] const tracking::TrackingCamera& camera() const { return camera_; }
  /// Camera looks along x, body at the camera.
  [[nodiscard]] static geometry::SE3 T_body_camera() {
    return {geometry::SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), Eigen::Vector3d::Zero()};
  }

  /// Moves every `stride`-th point: things that drive.
  void move_some(std::size_t stride, const Eigen::Vector3d& step_world) {
    for (std::size_t i = 0; i < points_.size(); i += stride) points_[i].p_world += step_world;
  }

  [[nodiscard]] tracking::Frame see(const geometry::SE3& T_world_camera,
                                    std::uint64_t frame_id,
                                    std::int64_t stamp_ns) {
    return see(T_world_camera, frame_id, stamp_ns, View());
  }
  [[nodiscard]] tracking::Frame see(const geometry::SE3& T_world_camera,
                                    std::uint64_t frame_id,
                                    std::int64_t stamp_ns,
                                    const View& view) {
    tracking::Frame frame;
    frame.frame_id = frame_id;
    frame.stamp_ns = stamp_ns;
    const geometry::SE3 T_camera_world = T_world_camera.inverse();
    for (const auto& point : points_) {
      if (static_cast<int>(frame.features.size()) == view.max_features) break;
      add(point, T_camera_world * point.p_world, view, frame.features);
    }
    return frame;
  }

 private:
  struct Point {
    Eigen::Vector3d p_world;
    float max_distance_m = 0.0F;
    float angle_rad = 0.0F;
    features::Descriptor descriptor;
  };

  void add(const Point& point,
           const Eigen::Vector3d& p_camera,
           const View& view,
           features::FrameFeatures& features) {
    if (p_camera.z() < 1.0) return;
    const auto distance_m = static_cast<float>(p_camera.norm());
    const long octave = std::lround(std::log(point.max_distance_m / distance_m) / std::log(1.2F));
    if (octave < 0 || octave >= camera_.scale.levels) return;
    const auto& pinhole = camera_.pinhole;
    std::normal_distribution<double> normal;
    const double sigma_px = view.noise_px * std::pow(1.2, static_cast<double>(octave));
    const double u_px = pinhole.fx_px * p_camera.x() / p_camera.z() + pinhole.cx_px;
    const double v_px = pinhole.fy_px * p_camera.y() / p_camera.z() + pinhole.cy_px;
    const Eigen::Vector2f seen_px(static_cast<float>(u_px + sigma_px * normal(random_)),
                                  static_cast<float>(v_px + sigma_px * normal(random_)));
    if (seen_px.x() < 0.0F || seen_px.y() < 0.0F || seen_px.x() >= 640.0F ||
        seen_px.y() >= 480.0F) {
      return;
    }
    features::KeyPoint key_point;
    key_point.u_px = seen_px.x();
    key_point.v_px = seen_px.y();
    key_point.angle_rad = point.angle_rad;
    key_point.octave = static_cast<std::uint8_t>(octave);
    features.key_points.push_back(key_point);
    features.undistorted_px.push_back(seen_px);
    features::Descriptor descriptor = point.descriptor;
    for (int flip = 0; flip < 12; ++flip) {
      const auto bit = random_() % 256;
      descriptor.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
    features.descriptors.push_back(descriptor);
    const bool has_depth = p_camera.z() < view.max_depth_m;
    const double depth_m = p_camera.z() + view.noise_depth_m * normal(random_);
    features.depth_m.push_back(has_depth ? static_cast<float>(depth_m) : 0.0F);
    features.depth_sigma_m.push_back(
        has_depth ? static_cast<float>(std::max(view.noise_depth_m, 0.01)) : 0.0F);
  }

  std::mt19937 random_;
  tracking::TrackingCamera camera_;
  std::vector<Point> points_;
};

}  // namespace camvox::test
