#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "camvox/calibration/scene.hpp"
#include "camvox/config/parameters.hpp"

namespace camvox::calibration {

/// Why a camera should see an edge at a place.
enum class EdgeKind : std::uint8_t {
  kReflectivity,  ///< The surface changes its reflectivity; its depth goes on.
  kDepth,         ///< A nearer surface ends; the point lies on that one.
  kOutline        ///< The same, found between two neighbouring returns of one scan line.
};

/// A piece of an edge that the lidar saw, in the lidar frame.
struct LidarEdge {
  Eigen::Vector3d p_lidar;
  Eigen::Vector3d tangent_lidar;  ///< Unit vector along the edge, across the line of sight.
  /// By how much the point moves, m, for each radian by which the lidar sees near things too wide
  /// (column 0, along the view's rows) and too high (column 1). Zero for reflectivity.
  Eigen::Matrix<double, 3, 2> widening_lidar = Eigen::Matrix<double, 3, 2>::Zero();
  float strength = 0.0F;  ///< 0 to 1: rank among the edges of its kind.
  EdgeKind kind = EdgeKind::kReflectivity;
};

/// Tuning of extract_lidar_edges. YAML keys are the field names.
struct LidarEdgeConfig {
  double min_range_m = 0.5;             ///< Nearer returns are ignored.
  double max_range_m = 150.0;           ///< Farther returns are ignored.
  double smoothing = 1.3;               ///< Sigma of the smoothing, in mean distances of returns.
  double min_reflectivity_step = 0.08;  ///< Of 1, the whole range after equalisation.
  double min_depth_ratio = 1.08;        ///< From behind to before an edge in depth.
  int min_length = 6;                   ///< Shorter edges are clutter; in cells of the panorama.
  int max_edges = 6000;                 ///< The strongest are kept, evenly over the view.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("min_range_m", self.min_range_m, config::at_least(0.0));
    field("max_range_m", self.max_range_m, config::greater_than(0.0));
    field("smoothing", self.smoothing, config::at_least(0.3), config::at_most(10.0));
    field("min_reflectivity_step", self.min_reflectivity_step, config::greater_than(0.0));
    field("min_depth_ratio", self.min_depth_ratio, config::greater_than(1.0));
    field("min_length", self.min_length, config::at_least(1));
    field("max_edges", self.max_edges, config::at_least(10));
  }
};

/// The part of the surroundings that matters: a cone around the camera's axis.
struct LidarView {
  Eigen::Matrix3d R_view_lidar;  ///< About the camera's axes: z forward, y down.
  double half_width_rad = 0.8;   ///< To the left and right of the axis.
  double half_height_rad = 0.4;  ///< Above and below.
  double min_cell_rad = 0.001;   ///< Finer cells than a pixel make no sense.
};

/// Edges of a cloud and how finely the lidar sampled them.
struct LidarEdges {
  std::vector<LidarEdge> edges;
  double sigma_rad = 0.0;  ///< Of the smoothing under which they were found.
  std::size_t points_in_view = 0;
};

/// Finds edges in reflectivity and depth where they are independent of any calibration: in a
/// panorama around the lidar itself, in which nothing hides anything. Returns are averaged in
/// cells and smoothed by normalised convolution as wide as the returns are dense, so that the same
/// code reads a few seconds of a Livox and one turn of a spinning lidar. Edges of depth are put on
/// the nearer surface; where depth jumps, reflectivity is no edge of its own (no bleeding).
/// Where scan lines are farther apart than pixels (one turn of a spinning lidar), outlines come on
/// top: see find_outlines in outlines.hpp. Empty if there are too few returns, or `stop` asks.
/// `R_view_lidar` only needs to be roughly right.
///
/// Idea of depth-continuous edges: Yuan et al., "Pixel-level extrinsic self calibration of high
/// resolution lidar and camera in targetless environments", RA-L 2021. Normalised convolution:
/// Knutsson & Westin, CVPR 1993.
[[nodiscard]] LidarEdges extract_lidar_edges(const std::vector<Eigen::Vector4f>& points_lidar,
                                             const LidarView& view,
                                             const LidarEdgeConfig& config,
                                             const std::stop_token& stop = {});

}  // namespace camvox::calibration
