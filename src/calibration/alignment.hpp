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

/// One step's normal equations, for a right perturbation: [rotation; translation] of the lidar.
struct NormalEquations {
  geometry::Matrix6d H = geometry::Matrix6d::Zero();
  geometry::Vector6d b = geometry::Vector6d::Zero();
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

/// What holds the translation where the scenes do not.
struct TranslationPrior {
  Eigen::Vector3d t_camera_lidar = Eigen::Vector3d::Zero();
  double sigma_m = 0.1;
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
                                    const TranslationPrior& prior,
                                    Part part = Part::kAll) const;

  /// The last stage: image contrast itself, searched across each edge within `reach_px`.
  [[nodiscard]] geometry::SE3 refine(const geometry::SE3& T_camera_lidar,
                                     double reach_px,
                                     const TranslationPrior& prior,
                                     Part part = Part::kAll) const;

  /// The normal equations of `refine` at a pose.
  [[nodiscard]] NormalEquations linearise(const geometry::SE3& T_camera_lidar,
                                          double reach_px,
                                          Part part = Part::kAll) const;

  /// The right side of `linearise`, for each tile of each scene.
  [[nodiscard]] std::vector<geometry::Vector6d> tile_gradients(const geometry::SE3& T_camera_lidar,
                                                               double reach_px) const;

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
  void for_each_match(const PreparedScene& scene,
                      const geometry::SE3& T_camera_lidar,
                      double reach_px,
                      Part part,
                      Visit&& visit) const;

  sensors::CameraModel camera_;
  std::vector<PreparedScene> scenes_;
};

/// How much one of many neighbouring edges tells: their errors are not independent.
inline constexpr double kIndependentShare = 0.1;

/// Adds the prior and solves for a step; `sigma_px` is the error of one edge.
[[nodiscard]] geometry::Vector6d solve_step(const NormalEquations& equations,
                                            const geometry::SE3& T_camera_lidar,
                                            const TranslationPrior& prior,
                                            double sigma_px);

/// Information (inverse covariance) of the data and of the prior, a round one: free of rotations.
[[nodiscard]] geometry::Matrix6d information(const NormalEquations& equations, double sigma_px);
[[nodiscard]] geometry::Matrix6d prior_information(const TranslationPrior& prior);

}  // namespace camvox::calibration
