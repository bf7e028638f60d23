#include "camvox/calibration/camvox_method.hpp"

#include <ceres/ceres.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "kd_tree.hpp"

namespace camvox::calibration {
namespace {

using geometry::SE3;
using geometry::SO3;

constexpr double kDegree = std::numbers::pi / 180.0;

/// Canny edges without short ones and without what lies inside of others: only outer contours.
std::vector<cv::Point2f> clean_edges(const cv::Mat& smooth, double low, int min_length) {
  cv::Mat edges;
  cv::Canny(smooth, edges, low, 3.0 * low, 3, true);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(edges, contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
  std::vector<cv::Point2f> points;
  for (const auto& contour : contours) {
    if (static_cast<int>(contour.size()) < min_length) continue;
    for (const cv::Point& point : contour) points.emplace_back(point);
  }
  return points;
}

cv::Mat equalised(const cv::Mat& image) {
  cv::Mat result;
  cv::equalizeHist(image, result);
  cv::GaussianBlur(result, result, {5, 5}, 0.0);
  return result;
}

/// A rotation of the camera's axes before the extrinsics.
SE3 turned(const SE3& T_camera_lidar, const Eigen::Vector3d& turn_rad) {
  return {SO3::exp(turn_rad) * T_camera_lidar.rotation(), T_camera_lidar.translation()};
}

/// The cost along one axis, for Ceres: central differences half a step wide.
class AxisCost final : public ceres::FirstOrderFunction {
 public:
  AxisCost(const CamvoxCost& cost, const SE3& T_camera_lidar, int axis, double step_rad)
      : cost_(cost), T_camera_lidar_(T_camera_lidar), axis_(axis), step_rad_(step_rad) {}

  bool Evaluate(const double* steps, double* value, double* slope) const override {
    *value = at(*steps);
    if (slope != nullptr) *slope = at(*steps + 0.5) - at(*steps - 0.5);
    return true;
  }
  [[nodiscard]] int NumParameters() const override { return 1; }

 private:
  [[nodiscard]] double at(double steps) const {
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    turn[axis_] = steps * step_rad_;
    return cost_(turned(T_camera_lidar_, turn));
  }
  const CamvoxCost& cost_;
  SE3 T_camera_lidar_;
  int axis_;
  double step_rad_;
};

}  // namespace

CamvoxCost::CamvoxCost(const Scene& scene,
                       const sensors::CameraModel& camera,
                       const CamvoxMethodConfig& config)
    : camera_(camera), config_(config) {
  constexpr std::size_t kEnough = 300000;
  const std::size_t stride = 1 + scene.points_lidar.size() / kEnough;
  for (std::size_t i = 0; i < scene.points_lidar.size(); i += stride) {
    if (scene.points_lidar[i].allFinite()) points_lidar_.push_back(scene.points_lidar[i]);
  }
  // The mean over every n-th edge point is the mean over all, n times sooner.
  constexpr std::size_t kEnoughEdges = 8000;
  const auto edges = clean_edges(equalised(to_grey(scene.image)), 60.0, config.min_camera_edge_px);
  const std::size_t edge_stride = 1 + edges.size() / kEnoughEdges;
  for (std::size_t i = 0; i < edges.size(); i += edge_stride) camera_edges_px_.push_back(edges[i]);
}

double CamvoxCost::operator()(const SE3& T_camera_lidar) const {
  const cv::Size size(camera_.intrinsics().width_px, camera_.intrinsics().height_px);
  cv::Mat reflectivity(size, CV_8U, cv::Scalar(0));
  cv::Mat closeness(size, CV_8U, cv::Scalar(0));
  for (const Eigen::Vector4f& point : points_lidar_) {
    const Eigen::Vector3d p_camera = T_camera_lidar * point.head<3>().cast<double>();
    const auto u_px = camera_.project(p_camera);
    if (!u_px || !camera_.contains(*u_px)) continue;
    const cv::Point at(static_cast<int>(std::lround(u_px->x())),
                       static_cast<int>(std::lround(u_px->y())));
    const auto near = cv::saturate_cast<std::uint8_t>(255.0 - 50.0 * std::log(p_camera.z() + 1.0));
    if (near < closeness.at<std::uint8_t>(at)) continue;
    closeness.at<std::uint8_t>(at) = near;
    reflectivity.at<std::uint8_t>(at) = cv::saturate_cast<std::uint8_t>(point.w() + 1.0F);
  }
  std::vector<cv::Point2f> lidar_edges_px;
  for (const cv::Mat& image : {reflectivity, closeness}) {
    cv::Mat filled;
    cv::dilate(image, filled, cv::Mat::ones(3, 3, CV_8U));
    const auto edges = clean_edges(equalised(filled), 60.0, config_.min_lidar_edge_px);
    lidar_edges_px.insert(lidar_edges_px.end(), edges.begin(), edges.end());
  }
  const double worst = config_.max_distance_px + config_.unmatched_weight;
  if (lidar_edges_px.size() < 2 || camera_edges_px_.empty()) return worst;
  const KdTree2 tree(std::move(lidar_edges_px));
  double sum = 0.0;
  std::size_t matched = 0;
  for (const cv::Point2f& point : camera_edges_px_) {
    for (const float distance_px : tree.two_nearest(point)) {
      if (static_cast<double>(distance_px) > config_.max_distance_px) continue;
      sum += static_cast<double>(distance_px);
      ++matched;
    }
  }
  if (matched == 0) return worst;
  const auto wanted = static_cast<double>(2 * camera_edges_px_.size());
  return sum / static_cast<double>(matched) +
         config_.unmatched_weight * (wanted - static_cast<double>(matched)) / wanted;
}

SE3 camvox_descend(const CamvoxCost& cost,
                   const SE3& T_camera_lidar,
                   const CamvoxMethodConfig& config,
                   const std::stop_token& stop) {
  SE3 T = T_camera_lidar;
  double best = cost(T);
  double step_rad = config.first_step_deg * kDegree;
  for (int round = 0; round < config.rounds; ++round, step_rad *= 0.5) {
    for (int axis = 0; axis < 3; ++axis) {
      if (stop.stop_requested()) return T_camera_lidar;
      ceres::GradientProblem problem(new AxisCost(cost, T, axis, step_rad));
      ceres::GradientProblemSolver::Options options;
      options.max_num_iterations = 2;
      options.max_num_line_search_step_size_iterations = 4;
      options.max_num_line_search_direction_restarts = 1;
      options.logging_type = ceres::SILENT;
      double steps = 0.0;
      ceres::GradientProblemSolver::Summary summary;
      ceres::Solve(options, problem, &steps, &summary);
      Eigen::Vector3d turn = Eigen::Vector3d::Zero();
      turn[axis] = std::clamp(steps, -10.0, 10.0) * step_rad;
      const SE3 next = turned(T, turn);
      const double value = cost(next);
      if (value < best) {
        best = value;
        T = next;
      }
    }
  }
  return T;
}

}  // namespace camvox::calibration
