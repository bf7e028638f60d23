#include "camvox/loop/surroundings.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "back_projection.hpp"

namespace camvox::loop {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using geometry::SE3;

/// The level frame of the place in the place's camera frame.
SE3 level_frame(std::span<const SurfaceView> views, std::size_t centre) {
  Vector3d up = Vector3d::Zero();
  for (const auto& view : views) up -= view.T_place_camera.rotation() * Vector3d::UnitY();
  const Vector3d path =
      views.back().T_place_camera.translation() - views.front().T_place_camera.translation();
  // A short or winding path says nothing about what is level.
  if (path.norm() > 3.0) up -= up.dot(path.normalized()) * path.normalized();
  up.normalize();
  const Vector3d ahead = views[centre].T_place_camera.rotation() * Vector3d::UnitZ();
  Eigen::Matrix3d R;
  R.col(2) = up;
  R.col(0) = (ahead - ahead.dot(up) * up).normalized();
  R.col(1) = R.col(2).cross(R.col(0));
  return {geometry::SO3(Eigen::Quaterniond(R)), views[centre].T_place_camera.translation()};
}

std::uint64_t cube(const Vector3f& point, float grain_m) {
  constexpr std::int64_t kHalf = 1 << 20;
  std::uint64_t key = 0;
  for (int axis = 2; axis >= 0; --axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(point[axis] / grain_m)) + kHalf;
    key = key << 21U | static_cast<std::uint64_t>(std::clamp<std::int64_t>(cell, 0, 2 * kHalf - 1));
  }
  return key;
}

}  // namespace

std::vector<Vector3f> surface_points(const features::FrameFeatures& features,
                                     const optimization::PinholeCamera& camera,
                                     double max_depth_m) {
  std::vector<Vector3f> points;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const double depth_m = features.depth_m[i];
    if (!(depth_m > 0.0) || depth_m > max_depth_m) continue;
    points.push_back((depth_m * ray(features.undistorted_px[i], camera)).cast<float>());
  }
  return points;
}

std::vector<Vector3f> thin(std::span<const Vector3f> points, double grain_m) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  order.reserve(points.size());
  for (std::uint32_t i = 0; i < points.size(); ++i) {
    order.emplace_back(cube(points[i], static_cast<float>(grain_m)), i);
  }
  std::sort(order.begin(), order.end());
  std::vector<Vector3f> thinned;
  for (std::size_t begin = 0; begin < order.size();) {
    Vector3f sum = Vector3f::Zero();
    std::size_t end = begin;
    for (; end < order.size() && order[end].first == order[begin].first; ++end) {
      sum += points[order[end].second];
    }
    thinned.push_back(sum / static_cast<float>(end - begin));
    begin = end;
  }
  return thinned;
}

Surroundings gather(std::span<const SurfaceView> views,
                    std::size_t centre,
                    const SurroundingsConfig& config) {
  Surroundings around;
  around.T_place_level = level_frame(views, centre);
  const SE3 T_level_place = around.T_place_level.inverse();
  const auto max_m = static_cast<float>(config.max_range_m);
  const auto max_z = static_cast<float>(config.max_height_m);
  std::vector<Vector3f> points;
  for (const auto& view : views) {
    const SE3 T_level_camera = T_level_place * view.T_place_camera;
    const Eigen::Matrix3f R = T_level_camera.rotation().matrix().cast<float>();
    const Vector3f t = T_level_camera.translation().cast<float>();
    for (const auto& point_camera : view.points_camera) {
      const Vector3f point = R * point_camera + t;
      if (point.squaredNorm() < max_m * max_m && point.z() < max_z) points.push_back(point);
    }
  }
  around.points_level = thin(points, config.grain_m);
  return around;
}

}  // namespace camvox::loop
