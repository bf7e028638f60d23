#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "camvox/tracking/frame.hpp"
#include "camvox/tracking/tracker_config.hpp"

namespace camvox::bench {

/// A ring road with points on both sides, and the features that a camera on it sees: the looks of a
/// site of 200 m without images, at thousands of frames a minute. World axes: z up.
class SiteWorld {
 public:
  static constexpr double kRadius_m = 90.0;
  static constexpr double kLap_m = 2.0 * std::numbers::pi * kRadius_m;

  /// `changing`: the share of points that look different in every lap (parked cars, leaves, light).
  SiteWorld(unsigned seed, double changing) : random_(seed), sectors_(kSectors) {
    camera_.pinhole = {500.0, 500.0, 320.0, 240.0, 0.05};
    camera_.width_px = 640;
    camera_.height_px = 480;
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < kPoints; ++i) {
      const double angle_rad = std::numbers::pi * (1.0 + unit(random_));
      const double aside_m = 15.0 * unit(random_);
      Point point;
      const double height_m = std::abs(aside_m) < 4.0 ? 5.0 + unit(random_) : 5.0 * unit(random_);
      point.p_world = {(kRadius_m + aside_m) * std::cos(angle_rad),
                       (kRadius_m + aside_m) * std::sin(angle_rad),
                       height_m};
      point.max_distance_m = 8.0F + 40.0F * static_cast<float>(std::abs(unit(random_)));
      point.angle_rad = 3.0F + 3.0F * static_cast<float>(unit(random_));
      point.changes = std::abs(unit(random_)) < changing;
      for (auto& byte : point.descriptor.bytes) byte = static_cast<std::uint8_t>(random_());
      sectors_[sector_of(angle_rad)].push_back(point);
    }
  }

  [[nodiscard]] const tracking::TrackingCamera& camera() const { return camera_; }
  [[nodiscard]] static geometry::SE3 T_body_camera() {
    return {geometry::SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), Eigen::Vector3d::Zero()};
  }
  /// The body after `way_m`, counter-clockwise; no two laps keep the same lane.
  [[nodiscard]] static geometry::SE3 T_world_body(double way_m) {
    const double angle_rad = way_m / kRadius_m;
    const double radius_m = kRadius_m + 1.5 * std::sin(0.37 * angle_rad);
    return {geometry::SO3::exp({0.0, 0.0, angle_rad + 0.5 * std::numbers::pi}),
            {radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad), 0.0}};
  }

  void set_lap(std::uint64_t lap) { lap_ = lap; }
  [[nodiscard]] tracking::Frame see(const geometry::SE3& T_world_camera, std::uint64_t frame_id) {
    tracking::Frame frame;
    frame.frame_id = frame_id;
    const geometry::SE3 T_camera_world = T_world_camera.inverse();
    const auto& p = T_world_camera.translation();
    const std::size_t here = sector_of(std::atan2(p.y(), p.x()));
    for (std::size_t ahead = kSectors - 1; ahead < kSectors + kSectorsInView; ++ahead) {
      for (const auto& point : sectors_[(here + ahead) % kSectors]) {
        if (frame.features.size() >= kMaxFeatures) return frame;
        add(point, T_camera_world * point.p_world, frame.features);
      }
    }
    return frame;
  }

 private:
  struct Point {
    Eigen::Vector3d p_world;
    float max_distance_m = 0.0F;
    float angle_rad = 0.0F;
    bool changes = false;
    features::Descriptor descriptor;
  };
  static constexpr int kPoints = 42000;
  static constexpr std::size_t kSectors = 56;  ///< About 10 m of the road each.
  static constexpr std::size_t kSectorsInView = 6;
  static constexpr std::size_t kMaxFeatures = 800;

  static std::size_t sector_of(double angle_rad) {
    const double turns = angle_rad / (2.0 * std::numbers::pi);
    return static_cast<std::size_t>((turns - std::floor(turns)) * kSectors) % kSectors;
  }

  /// The same all through a lap.
  void disguise(features::Descriptor& descriptor) const {
    std::uint64_t noise = lap_ * 0x9E3779B97F4A7C15ULL;
    for (auto& byte : descriptor.bytes) {
      noise = noise * 6364136223846793005ULL + 1442695040888963407ULL;
      byte = static_cast<std::uint8_t>(byte ^ (noise >> 56U));
    }
  }

  void add(const Point& point, const Eigen::Vector3d& p_camera, features::FrameFeatures& features) {
    if (p_camera.z() < 1.0) return;
    const auto distance_m = static_cast<float>(p_camera.norm());
    const long octave = std::lround(std::log(point.max_distance_m / distance_m) / std::log(1.2F));
    if (octave < 0 || octave >= camera_.scale.levels) return;
    const double sigma_px = 0.5 * std::pow(1.2, static_cast<double>(octave));
    const auto& pinhole = camera_.pinhole;
    const double u_px = pinhole.fx_px * p_camera.x() / p_camera.z() + pinhole.cx_px;
    const double v_px = pinhole.fy_px * p_camera.y() / p_camera.z() + pinhole.cy_px;
    const Eigen::Vector2f seen_px(static_cast<float>(u_px + sigma_px * normal_(random_)),
                                  static_cast<float>(v_px + sigma_px * normal_(random_)));
    if (seen_px.x() < 0.0F || seen_px.y() < 0.0F || seen_px.x() >= 640.0F ||
        seen_px.y() >= 480.0F) {
      return;
    }
    features.key_points.push_back(
        {seen_px.x(), seen_px.y(), point.angle_rad, 0.0F, static_cast<std::uint8_t>(octave)});
    features.undistorted_px.push_back(seen_px);
    auto descriptor = point.descriptor;
    if (point.changes) disguise(descriptor);
    for (int flip = 0; flip < 12; ++flip) {
      const auto bit = random_() % 256;
      descriptor.bytes[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    }
    features.descriptors.push_back(descriptor);
    constexpr double kDepthSigma_m = 0.02;
    features.depth_m.push_back(static_cast<float>(p_camera.z() + kDepthSigma_m * normal_(random_)));
    features.depth_sigma_m.push_back(static_cast<float>(kDepthSigma_m));
  }

  std::uint64_t lap_ = 0;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  tracking::TrackingCamera camera_;
  std::vector<std::vector<Point>> sectors_;
};

}  // namespace camvox::bench
