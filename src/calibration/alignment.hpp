#pragma once

#include <cstdint>
#include <stop_token>
#include <vector>

#include "camvox/calibration/lidar_edges.hpp"
#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"
#include "edge_field.hpp"

namespace camvox::calibration {

/// Which edges of a scene are looked at: all, or those of one colour of a chessboard over the view.
enum class Part : std::uint8_t { kEven = 0, kOdd = 1, kAll = 2 };

/// Everything of one scene that the alignment needs, computed once.
struct PreparedScene {
  LidarEdges lidar;
  ImageEdges image;
  std::vector<EdgeField> fields;  ///< From coarse to fine.
  std::vector<Part> parts;        ///< Of every lidar edge.
  /// Of every lidar edge the tile of the view, from 0. Within a tile errors depend on each other:
  /// many edges follow one border; from tile to tile they hardly do.
  std::vector<std::size_t> tiles;
  std::size_t tile_count = 0;
};

/// What the last stage solves for: a right perturbation, [rotation; translation] of the lidar, and
/// by how much the lidar sees near things too wide and too high, rad.
using Vector8d = Eigen::Matrix<double, 8, 1>;
using Matrix8d = Eigen::Matrix<double, 8, 8>;

/// A pose, with what the lidar's beam adds to the outlines of things, rad: across and up.
struct Fit {
  geometry::SE3 T_camera_lidar;
  Eigen::Vector2d widening_rad = Eigen::Vector2d::Zero();
};

/// One step's normal equations.
struct NormalEquations {
  Matrix8d H = Matrix8d::Zero();
  Vector8d b = Vector8d::Zero();
  double weight = 0.0;             ///< Sum over the edges in the image.
  double inlier_weight = 0.0;      ///< The part of it that found its image edge.
  double squared_error_px2 = 0.0;  ///< Weighted, of those.
  double score = 0.0;              ///< Mean gain over chance; see Alignment::score.
};

/// By how much one pose fits better than another, nats per edge, and the standard error of that:
/// from the spread over the tiles.
struct Gain {
  double mean = 0.0;
  double standard_error = 0.0;
};

/// How the last stage looks at the edges.
struct Stage {
  double reach_px = 1.5;  ///< Sigma of the window across each edge.
  /// How much edges of a kind count.
  double reflectivity = 1.0;
  double depth = 1.0;
  double outline = 1.0;
  /// What all edges have in common and no spread shows, of the lidar's resolution: both sensors
  /// blur edges, the lidar more up and down than across.
  double shared_error = 0.3;

  [[nodiscard]] double weight(const LidarEdge& edge) const {
    const double of_kind = edge.kind == EdgeKind::kOutline ? outline
                           : edge.kind == EdgeKind::kDepth ? depth
                                                           : reflectivity;
    return of_kind * static_cast<double>(edge.strength);
  }
};

/// What holds the translation where the scenes do not, and the widening where all is reflectivity.
struct Prior {
  Eigen::Vector3d t_camera_lidar = Eigen::Vector3d::Zero();
  double sigma_m = 0.1;
  double widening_sigma_rad = 1e-3;
};

/// Fits the edges of the lidar to those of the camera, in all scenes at once.
///
/// The score of a pose is the mean over the lidar's edges of log(a + (1 - a) d): d is how many
/// times denser image edges of the right direction are around the projected edge than on average,
/// a the share of edges expected to have no counterpart. Each step is one of expectation
/// maximisation: an edge is drawn across its direction towards the mean of the image edges around.
class Alignment {
 public:
  Alignment(const sensors::CameraModel& camera, std::vector<PreparedScene> scenes)
      : camera_(camera), scenes_(std::move(scenes)) {}

  /// Mean gain over chance, in nats, under the fields of one level.
  [[nodiscard]] double score(const geometry::SE3& T_camera_lidar,
                             std::size_t level,
                             Part part = Part::kAll) const;

  /// The best rotations of a grid around `T_camera_lidar` within `reach_rad`, best first, at most
  /// `count`, no two within two steps of each other.
  [[nodiscard]] std::vector<geometry::SE3> search(const geometry::SE3& T_camera_lidar,
                                                  double reach_rad,
                                                  std::size_t count,
                                                  const std::stop_token& stop) const;

  /// Climbs the score of one level.
  [[nodiscard]] geometry::SE3 climb(const geometry::SE3& T_camera_lidar,
                                    std::size_t level,
                                    const Prior& prior,
                                    Part part = Part::kAll) const;

  /// The last stage: image contrast itself, searched across each edge.
  [[nodiscard]] Fit refine(const Fit& start,
                           const Stage& stage,
                           const Prior& prior,
                           Part part = Part::kAll) const;

  /// The normal equations of `refine`.
  [[nodiscard]] NormalEquations linearise(const Fit& fit,
                                          const Stage& stage,
                                          Part part = Part::kAll) const;

  /// The right side of `linearise`, for each tile of each scene.
  [[nodiscard]] std::vector<Vector8d> tile_gradients(const Fit& fit, const Stage& stage) const;

  /// Of `T_new` over `T_old`, in the score of one level.
  [[nodiscard]] Gain gain(const geometry::SE3& T_new,
                          const geometry::SE3& T_old,
                          std::size_t level,
                          Part part = Part::kAll) const;

  /// Of the pose over chance, if the share of edges without a counterpart is what fits best: near
  /// 0 for any wrong pose.
  [[nodiscard]] Gain gain_over_nothing(const geometry::SE3& T_camera_lidar,
                                       std::size_t level) const;

  /// What gain_over_nothing would be if the lidar had seen the edges of the images themselves.
  [[nodiscard]] double best_gain(std::size_t level) const;

  /// The sigma of a level's fields, as an angle.
  [[nodiscard]] double width_rad(std::size_t level) const {
    return scenes_.front().fields[level].sigma_px() / focal_px();
  }
  /// How many edges there are of a kind, in all scenes.
  [[nodiscard]] std::size_t count(EdgeKind kind) const;
  [[nodiscard]] double focal_px() const { return camera_.intrinsics().fx_px; }
  [[nodiscard]] std::size_t levels() const { return scenes_.front().fields.size(); }
  [[nodiscard]] const std::vector<PreparedScene>& scenes() const { return scenes_; }

 private:
  [[nodiscard]] NormalEquations climb_equations(const geometry::SE3& T_camera_lidar,
                                                std::size_t level,
                                                Part part) const;

  /// Around each edge of a scene, under the field of one level.
  [[nodiscard]] std::vector<float> densities(const PreparedScene& scene,
                                             const geometry::SE3& T_camera_lidar,
                                             std::size_t level) const;
  /// Calls visit(index of the edge, projected edge, match) for the edges of a scene in the image.
  template <typename Visit>
  void for_each_match(
      const PreparedScene& scene, const Fit& fit, double reach_px, Part part, Visit&& visit) const;

  sensors::CameraModel camera_;
  std::vector<PreparedScene> scenes_;
};

/// How much one of many neighbouring edges tells: their errors are not independent.
inline constexpr double kIndependentShare = 0.1;

/// Adds the prior and solves for a step; `sigma_px` is the error of one edge.
[[nodiscard]] Vector8d solve_step(const NormalEquations& equations,
                                  const Fit& fit,
                                  const Prior& prior,
                                  double sigma_px);

/// Inverse covariance of the prior, a round one: free of rotations.
[[nodiscard]] Matrix8d prior_information(const Prior& prior);

}  // namespace camvox::calibration
