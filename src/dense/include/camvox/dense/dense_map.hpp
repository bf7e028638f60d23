#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <unordered_set>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::dense {

/// Tuning of DenseMap. YAML keys are the field names.
struct DenseMapConfig {
  double voxel_size_m = 0.1;            ///< At most one point in each such cube.
  double min_depth_m = 0.5;             ///< Nearer pixels are left out.
  double max_depth_m = 50.0;            ///< Farther pixels are left out: they are few and blurred.
  double max_sigma_m = 0.25;            ///< Depths less certain than this are left out.
  int stride_px = 2;                    ///< Every how many columns and rows a pixel is taken.
  std::int64_t max_points = 4'000'000;  ///< Bound of memory, 100 bytes each; old parts are thinned.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("voxel_size_m", self.voxel_size_m, config::at_least(0.005), config::at_most(10.0));
    field("min_depth_m", self.min_depth_m, config::at_least(0.0));
    field("max_depth_m", self.max_depth_m, config::greater_than(0.0), config::at_most(1000.0));
    field("max_sigma_m", self.max_sigma_m, config::greater_than(0.0));
    field("stride_px", self.stride_px, config::at_least(1), config::at_most(64));
    field("max_points", self.max_points, config::at_least(1000));
  }
};

using Rgb = std::array<std::uint8_t, 3>;

/// The colour of a pixel of the camera's image.
using ColourAt = std::function<Rgb(int u_px, int v_px)>;

struct ColouredPoint {
  Eigen::Vector3f p;
  Rgb rgb{};
};

/// A depth image that somebody else keeps: rows from the top without gaps; 0 = no depth.
struct DepthImageView {
  const float* depth_m = nullptr;
  const float* sigma_m = nullptr;
  int width_px = 0;
  int height_px = 0;
};

/// The coloured points of all keyframes. Each keyframe keeps its own in camera axes, so that they
/// move with it when the map is corrected; nothing is filtered twice. A point is added only where
/// the map has none in that voxel yet, so a revisit adds little. Over the bound the oldest
/// keyframes are thinned to voxels of twice the size, again and again. The same calls give the same
/// map.
class DenseMap {
 public:
  /// Throws config::ConfigError.
  DenseMap(const DenseMapConfig& config, const sensors::CameraModel& camera);

  /// Adds what a keyframe sees. `depth` must have the camera's size, else std::logic_error.
  /// Returns how many points came.
  std::size_t add_keyframe(std::uint64_t id,
                           const geometry::SE3& T_map_camera,
                           const DepthImageView& depth,
                           const ColourAt& colour_at);
  void move_keyframe(std::uint64_t id, const geometry::SE3& T_map_camera);
  /// The keyframe is gone, what it saw is not: its points hang on the nearest older keyframe from
  /// now on, or the nearest newer one.
  void remove_keyframe(std::uint64_t id);

  [[nodiscard]] std::size_t size() const { return size_; }
  /// Voxels that count as occupied: those of the points, and for a while those of thinned ones.
  [[nodiscard]] std::size_t voxel_count() const { return voxels_.size(); }
  /// All points, in the map frame.
  [[nodiscard]] std::vector<ColouredPoint> points() const;
  /// Where the keyframes are, in the map frame.
  [[nodiscard]] std::vector<Eigen::Vector3d> keyframe_positions() const;

 private:
  struct Block {
    geometry::SE3 T_map_camera;
    double voxel_size_m = 0.0;
    std::vector<ColouredPoint> points_camera;
  };

  void note_motion(const geometry::SE3& T_before, const geometry::SE3& T_after);
  void refill_voxels();
  [[nodiscard]] std::size_t most_voxels() const;
  void bound_memory();
  void thin(Block& block);

  DenseMapConfig config_;
  int width_px_;
  int height_px_;
  std::vector<Eigen::Vector2f> rays_;  ///< x/z, y/z of every taken pixel; NaN: none.
  std::map<std::uint64_t, Block> blocks_;
  std::unordered_set<std::uint64_t> voxels_;  ///< Occupied ones; only asked, never walked through.
  bool voxels_stale_ = false;
  std::size_t size_ = 0;
};

}  // namespace camvox::dense
