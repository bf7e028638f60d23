#include "camvox/dense/dense_map.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

namespace camvox::dense {
namespace {

/// 21 bits an axis: 105 km each way at 10 cm.
std::uint64_t voxel_key(const Eigen::Vector3f& p, double voxel_size_m) {
  std::uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto cell = static_cast<std::int64_t>(std::floor(p[axis] / voxel_size_m));
    key = (key << 21) | (static_cast<std::uint64_t>(cell + (1 << 20)) & 0x1FFFFFU);
  }
  return key;
}

std::vector<Eigen::Vector2f> rays_of(const sensors::CameraModel& camera, int stride_px) {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::vector<Eigen::Vector2f> rays;
  for (int v = 0; v < camera.intrinsics().height_px; v += stride_px) {
    for (int u = 0; u < camera.intrinsics().width_px; u += stride_px) {
      const auto ray = camera.unproject({u, v});
      rays.push_back(
          ray.converged ? Eigen::Vector2f((ray.f_camera.head<2>() / ray.f_camera.z()).cast<float>())
                        : Eigen::Vector2f(kNone, kNone));
    }
  }
  return rays;
}

}  // namespace

DenseMap::DenseMap(const DenseMapConfig& config, const sensors::CameraModel& camera)
    : config_(config),
      width_px_(camera.intrinsics().width_px),
      height_px_(camera.intrinsics().height_px) {
  if (const auto problems = config::check(config, "dense map"); !problems.empty()) {
    throw config::ConfigError(problems);
  }
  rays_ = rays_of(camera, config.stride_px);
}

std::size_t DenseMap::add_keyframe(std::uint64_t id,
                                   const geometry::SE3& T_map_camera,
                                   const DepthImageView& depth,
                                   const ColourAt& colour_at) {
  if (depth.width_px != width_px_ || depth.height_px != height_px_) {
    throw std::logic_error("DenseMap: the depth image is not of the camera's size");
  }
  if (blocks_.contains(id)) return 0;
  if (voxels_stale_ || voxels_.size() > most_voxels()) refill_voxels();
  Block block{T_map_camera, config_.voxel_size_m, {}};
  const Eigen::Matrix3f R_map_camera = T_map_camera.rotation().matrix().cast<float>();
  const Eigen::Vector3f t_map_camera = T_map_camera.translation().cast<float>();
  std::size_t ray = 0;
  for (int v = 0; v < height_px_; v += config_.stride_px) {
    const auto row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width_px_);
    for (int u = 0; u < width_px_; u += config_.stride_px, ++ray) {
      const std::size_t pixel = row + static_cast<std::size_t>(u);
      const float z = depth.depth_m[pixel];
      const bool usable = z >= config_.min_depth_m && z <= config_.max_depth_m &&
                          depth.sigma_m[pixel] <= config_.max_sigma_m &&
                          std::isfinite(rays_[ray].x());
      if (!usable) continue;
      const Eigen::Vector3f p_camera(rays_[ray].x() * z, rays_[ray].y() * z, z);
      const Eigen::Vector3f p_map = R_map_camera * p_camera + t_map_camera;
      if (!voxels_.insert(voxel_key(p_map, config_.voxel_size_m)).second) continue;
      block.points_camera.push_back({p_camera, colour_at(u, v)});
    }
  }
  block.points_camera.shrink_to_fit();
  const std::size_t added = block.points_camera.size();
  size_ += added;
  blocks_.emplace(id, std::move(block));
  bound_memory();
  return added;
}

void DenseMap::move_keyframe(std::uint64_t id, const geometry::SE3& T_map_camera) {
  const auto found = blocks_.find(id);
  if (found == blocks_.end()) return;
  note_motion(found->second.T_map_camera, T_map_camera);
  found->second.T_map_camera = T_map_camera;
}

/// Motions of less than half a voxel leave the occupied voxels good enough.
void DenseMap::note_motion(const geometry::SE3& T_before, const geometry::SE3& T_after) {
  const auto motion = geometry::local(T_before, T_after);
  const double far_m =
      motion.tail<3>().norm() + 0.5 * config_.max_depth_m * motion.head<3>().norm();
  if (far_m > 0.5 * config_.voxel_size_m) voxels_stale_ = true;
}

void DenseMap::remove_keyframe(std::uint64_t id) {
  const auto removed = blocks_.find(id);
  if (removed == blocks_.end() || blocks_.size() == 1) return;
  const auto heir = removed == blocks_.begin() ? std::next(removed) : std::prev(removed);
  const geometry::SE3 T_heir_removed =
      heir->second.T_map_camera.inverse() * removed->second.T_map_camera;
  const Eigen::Matrix3f R = T_heir_removed.rotation().matrix().cast<float>();
  const Eigen::Vector3f t = T_heir_removed.translation().cast<float>();
  for (const auto& point : removed->second.points_camera) {
    heir->second.points_camera.push_back({R * point.p + t, point.rgb});
  }
  blocks_.erase(removed);
}

void DenseMap::refill_voxels() {
  voxels_.clear();
  for (const auto& point : points()) voxels_.insert(voxel_key(point.p, config_.voxel_size_m));
  voxels_stale_ = false;
}

/// Thinning leaves the voxels of the points that it takes. Half of them may be such: a refill
/// visits every point, and comes only once as many points were added as the map holds.
std::size_t DenseMap::most_voxels() const {
  return 2 * std::max(size_, static_cast<std::size_t>(config_.max_points));
}

void DenseMap::bound_memory() {
  const auto limit = static_cast<std::size_t>(config_.max_points);
  if (size_ <= limit) return;
  // Down to 7/8, so that it does not come at every keyframe; the oldest of the finest go first.
  while (size_ > limit - limit / 8) {
    const auto finest =
        std::min_element(blocks_.begin(), blocks_.end(), [](const auto& a, const auto& b) {
          return a.second.voxel_size_m < b.second.voxel_size_m;
        });
    if (finest->second.voxel_size_m > config_.max_depth_m)
      break;  // a point a block: no more to win
    thin(finest->second);
  }
}

void DenseMap::thin(Block& block) {
  block.voxel_size_m *= 2.0;
  std::unordered_set<std::uint64_t> seen;
  std::vector<ColouredPoint> kept;
  for (const auto& point : block.points_camera) {
    if (seen.insert(voxel_key(point.p, block.voxel_size_m)).second) kept.push_back(point);
  }
  size_ -= block.points_camera.size() - kept.size();
  kept.shrink_to_fit();
  block.points_camera = std::move(kept);
}

std::vector<ColouredPoint> DenseMap::points() const {
  std::vector<ColouredPoint> all;
  all.reserve(size_);
  for (const auto& [id, block] : blocks_) {
    const Eigen::Matrix3f R = block.T_map_camera.rotation().matrix().cast<float>();
    const Eigen::Vector3f t = block.T_map_camera.translation().cast<float>();
    for (const auto& point : block.points_camera) all.push_back({R * point.p + t, point.rgb});
  }
  return all;
}

std::vector<Eigen::Vector3d> DenseMap::keyframe_positions() const {
  std::vector<Eigen::Vector3d> positions;
  for (const auto& entry : blocks_) positions.push_back(entry.second.T_map_camera.translation());
  return positions;
}

}  // namespace camvox::dense
