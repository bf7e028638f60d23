#pragma once

#include <opencv2/core/types.hpp>
#include <stop_token>
#include <vector>

#include "camvox/calibration/scene.hpp"
#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::calibration {

/// Tuning of the paper's method. YAML keys are the field names.
struct CamvoxMethodConfig {
  double unmatched_weight = 10.0;  ///< b of the paper's cost.
  double max_distance_px = 20.0;   ///< An edge point farther from all others is unmatched.
  int min_camera_edge_px = 50;     ///< Shorter edges of the image are dropped.
  int min_lidar_edge_px = 40;      ///< Shorter edges of the projected cloud are dropped.
  double first_step_deg = 0.4;     ///< Of the coordinate descent; halved each round.
  int rounds = 5;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("unmatched_weight", self.unmatched_weight, config::at_least(0.0));
    field("max_distance_px", self.max_distance_px, config::greater_than(0.0));
    field("min_camera_edge_px", self.min_camera_edge_px, config::at_least(0));
    field("min_lidar_edge_px", self.min_lidar_edge_px, config::at_least(0));
    field("first_step_deg", self.first_step_deg, config::greater_than(0.0));
    field("rounds", self.rounds, config::at_least(1), config::at_most(20));
  }
};

/// The cost of Zhu et al., "CamVox: A Low-cost and Accurate Lidar-assisted Visual SLAM System",
/// ICRA 2021, section III.C: reflectivity and depth are projected with the extrinsics to two
/// images, equalised, their Canny edges cleaned of short ones and of clutter inside; cost is the
/// mean distance of the image's edge points to the two nearest of the cloud's, plus b times the
/// unmatched share. The image's edges are found once.
class CamvoxCost {
 public:
  CamvoxCost(const Scene& scene,
             const sensors::CameraModel& camera,
             const CamvoxMethodConfig& config);

  /// In pixels; the largest possible value if nothing matches.
  [[nodiscard]] double operator()(const geometry::SE3& T_camera_lidar) const;

 private:
  sensors::CameraModel camera_;
  CamvoxMethodConfig config_;
  std::vector<Eigen::Vector4f> points_lidar_;
  std::vector<cv::Point2f> camera_edges_px_;
};

/// The paper's optimisation: coordinate descent over roll, pitch and yaw of the camera, each line
/// search by Ceres with numeric derivatives; translation stays. Returns the start if `stop` asks.
[[nodiscard]] geometry::SE3 camvox_descend(const CamvoxCost& cost,
                                           const geometry::SE3& T_camera_lidar,
                                           const CamvoxMethodConfig& config,
                                           const std::stop_token& stop);

}  // namespace camvox::calibration
