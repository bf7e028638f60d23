#pragma once

#include <algorithm>
#include <map>
#include <random>
#include <vector>

#include "camvox/mapping/mapper.hpp"

namespace camvox::mapping {

struct WorldOptions {
  int points = 1500;
  double noise_px = 0.5;
  double depth_sigma_m = 0.03;
  double depth_share = 0.7;  ///< Of the features: the others have none.
  double pose_noise = 0.01;  ///< rad and 5 times that in m, of the poses that tracking gives.
  double length_m = 40.0;    ///< Of the street.
  double max_range_m = 25.0;
};

/// A street of points with distinct descriptors, and a stand-in for tracking: it sees the points
/// from true poses, knows each by its descriptor, and gives keyframes with noisy poses.
class MappingWorld {
 public:
  explicit MappingWorld(const WorldOptions& options = {}, unsigned seed = 1)
      : options_(options), random_(seed) {
    camera_.pinhole = {700.0, 710.0, 620.0, 187.0, 0.05};
    camera_.width_px = 1242;
    camera_.height_px = 375;
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < options.points; ++i) {
      points_map_.emplace_back(10.0 * unit(random_),
                               2.5 * unit(random_),
                               0.5 * options.length_m * (1.0 + unit(random_)));
      features::Descriptor descriptor;
      for (auto& byte : descriptor.bytes) byte = static_cast<std::uint8_t>(random_());
      descriptors_.push_back(descriptor);
    }
  }

  [[nodiscard]] const tracking::TrackingCamera& camera() const { return camera_; }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& points_map() const { return points_map_; }
  [[nodiscard]] const std::vector<geometry::SE3>& T_map_camera() const { return T_map_camera_; }
  /// The world's point that a feature of a keyframe shows.
  [[nodiscard]] int point_of(KeyframeId id, std::size_t feature) const {
    return shown_.at(id)[feature];
  }

  /// What tracking would send at a true pose, given the map so far. The first one's pose is exact.
  /// It recognises only what keyframes from `oldest_known` on see.
  tracking::Keyframe look(const geometry::SE3& T_map_camera,
                          const Mapper& mapper,
                          KeyframeId oldest_known = 1) {
    tracking::Keyframe keyframe;
    keyframe.id = next_id_++;
    keyframe.frame_id = 10 * keyframe.id;
    keyframe.stamp_ns = static_cast<std::int64_t>(keyframe.id) * 1'000'000'000;
    keyframe.map_epoch = mapper.epoch();
    T_map_camera_.push_back(T_map_camera);
    keyframe.T_map_camera = estimate(T_map_camera, mapper);
    const auto& keyframes = mapper.map().keyframes();
    if (!keyframes.empty()) {
      keyframe.parent_id = keyframes.rbegin()->first;
      keyframe.T_parent_camera =
          keyframes.rbegin()->second.frame.T_map_camera.inverse() * keyframe.T_map_camera;
    }
    const auto known = known_landmarks(mapper, oldest_known);
    for (std::size_t i = 0; i < points_map_.size(); ++i) see(i, T_map_camera, known, keyframe);
    return keyframe;
  }

  /// Steps along the street: keyframe number `i` of a straight drive.
  [[nodiscard]] static geometry::SE3 on_street(double z_m, double x_m = 0.0) {
    return {geometry::SO3::exp({0.0, 0.02 * x_m, 0.0}), Eigen::Vector3d(x_m, 0.0, z_m)};
  }

 private:
  geometry::SE3 estimate(const geometry::SE3& T_map_camera, const Mapper& mapper) {
    if (mapper.map().keyframes().empty()) return T_map_camera;
    geometry::Vector6d xi;
    for (int k = 0; k < 6; ++k) {
      xi[k] = (k < 3 ? 0.1 : 1.0) * 5.0 * options_.pose_noise * normal_(random_);
    }
    return geometry::retract(T_map_camera, xi);
  }

  /// The landmark that stands for each point at present.
  [[nodiscard]] std::map<std::size_t, LandmarkId> known_landmarks(const Mapper& mapper,
                                                                  KeyframeId oldest_known) const {
    std::map<std::size_t, LandmarkId> known;
    for (const auto& [id, keyframe] : mapper.map().keyframes()) {
      if (id < oldest_known) continue;
      for (std::size_t i = 0; i < keyframe.frame.landmark_ids.size(); ++i) {
        const LandmarkId landmark = keyframe.frame.landmark_ids[i];
        if (landmark != 0) known[static_cast<std::size_t>(point_of(id, i))] = landmark;
      }
    }
    return known;
  }

  void see(std::size_t point,
           const geometry::SE3& T_map_camera,
           const std::map<std::size_t, LandmarkId>& known,
           tracking::Keyframe& keyframe) {
    const Eigen::Vector3d p_camera = T_map_camera.inverse() * points_map_[point];
    if (p_camera.z() < 1.5 || p_camera.z() > options_.max_range_m) return;
    const auto& pinhole = camera_.pinhole;
    const float u = static_cast<float>(pinhole.fx_px * p_camera.x() / p_camera.z() + pinhole.cx_px +
                                       options_.noise_px * normal_(random_));
    const float v = static_cast<float>(pinhole.fy_px * p_camera.y() / p_camera.z() + pinhole.cy_px +
                                       options_.noise_px * normal_(random_));
    if (u < 0.0F || v < 0.0F || u > 1241.0F || v > 374.0F) return;
    // A patch looks as large in the octave that its distance asks for: octave 0 beyond 20 m.
    const double octave = std::clamp(std::log(20.0 / p_camera.norm()) / std::log(1.2), 0.0, 7.0);
    auto& features = keyframe.features;
    features.key_points.push_back(
        {u, v, 0.1F, 1.0F, static_cast<std::uint8_t>(std::lround(octave))});
    features.undistorted_px.emplace_back(u, v);
    features.descriptors.push_back(descriptors_[point]);
    const bool has_depth =
        static_cast<double>((point * 2654435761U) % 1000U) < 1000.0 * options_.depth_share;
    features.depth_m.push_back(
        has_depth ? static_cast<float>(p_camera.z() + options_.depth_sigma_m * normal_(random_))
                  : 0.0F);
    features.depth_sigma_m.push_back(has_depth ? static_cast<float>(options_.depth_sigma_m) : 0.0F);
    const std::size_t i = features.size() - 1;
    const auto landmark = known.find(point);
    keyframe.landmark_ids.push_back(landmark != known.end() ? landmark->second
                                    : has_depth             ? tracking::landmark_id(keyframe.id, i)
                                                            : 0);
    shown_[keyframe.id].push_back(static_cast<int>(point));
  }

  WorldOptions options_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
  tracking::TrackingCamera camera_;
  std::vector<Eigen::Vector3d> points_map_;
  std::vector<features::Descriptor> descriptors_;
  std::vector<geometry::SE3> T_map_camera_;
  std::map<KeyframeId, std::vector<int>> shown_;
  KeyframeId next_id_ = 1;
};

/// A mapper that drove `count` keyframes along the street.
inline Mapper drive(MappingWorld& world,
                    int count,
                    double step_m = 1.0,
                    MappingConfig config = {}) {
  Mapper mapper(config, world.camera());
  for (int i = 0; i < count; ++i) {
    mapper.process(world.look(MappingWorld::on_street(step_m * i), mapper));
  }
  return mapper;
}

/// The largest distance of a keyframe from where it was taken.
inline double worst_position_m(const Mapper& mapper, const MappingWorld& world) {
  double worst = 0.0;
  for (const auto& [id, keyframe] : mapper.map().keyframes()) {
    const auto& truth = world.T_map_camera()[id - 1];
    worst =
        std::max(worst, (keyframe.frame.T_map_camera.translation() - truth.translation()).norm());
  }
  return worst;
}

inline double mean_position_m(const Mapper& mapper, const MappingWorld& world) {
  double sum = 0.0;
  for (const auto& [id, keyframe] : mapper.map().keyframes()) {
    const auto& truth = world.T_map_camera()[id - 1];
    sum += (keyframe.frame.T_map_camera.translation() - truth.translation()).norm();
  }
  return sum / static_cast<double>(mapper.map().keyframes().size());
}

}  // namespace camvox::mapping
