#include "prepare.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace camvox::calibration {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kLevels_deg[] = {0.8, 0.4, 0.2, 0.1};
constexpr double kTile_rad = 0.12;    ///< Of the chessboard that parts the view in halves.
constexpr double kMinContrast = 3.0;  ///< Standard deviation of grey, of 255.
constexpr std::size_t kMinPoints = 1000;
constexpr std::size_t kMinLidarEdges = 150;
constexpr std::size_t kMinImageEdges = 500;

/// Numbers the tiles of a chessboard over the view in which there are edges.
void lay_chessboard(const LidarView& view, PreparedScene& scene) {
  std::map<std::pair<int, int>, std::size_t> tiles;
  for (const LidarEdge& edge : scene.lidar.edges) {
    const Eigen::Vector3d p = view.R_view_lidar * edge.p_lidar;
    const auto column = static_cast<int>(std::floor(std::atan2(p.x(), p.z()) / kTile_rad));
    const auto row = static_cast<int>(std::floor(std::atan2(p.y(), p.z()) / kTile_rad));
    scene.parts.push_back(((column + row) & 1) != 0 ? Part::kOdd : Part::kEven);
    scene.tiles.push_back(tiles.try_emplace({row, column}, tiles.size()).first->second);
  }
  scene.tile_count = tiles.size();
}

/// Appends one scene, or tells what is wrong with it.
CalibrationStatus prepare_one(const Scene& scene,
                              const sensors::CameraIntrinsics& intrinsics,
                              const LidarView& view,
                              const LidarEdgeConfig& config,
                              const std::stop_token& stop,
                              std::vector<PreparedScene>& prepared) {
  if (scene.image.cols != intrinsics.width_px || scene.image.rows != intrinsics.height_px) {
    return CalibrationStatus::kWrongImageSize;
  }
  const cv::Mat grey = to_grey(scene.image);
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(grey, mean, deviation);
  if (deviation[0] < kMinContrast) return CalibrationStatus::kBlankImage;
  LidarEdges lidar = extract_lidar_edges(scene.points_lidar, view, config, stop);
  if (stop.stop_requested()) return CalibrationStatus::kCancelled;
  if (lidar.points_in_view < kMinPoints) return CalibrationStatus::kEmptyCloud;
  if (lidar.edges.size() < kMinLidarEdges) return CalibrationStatus::kNoLidarEdges;
  // Far coarser scans than images need the image as blurred as themselves to find the place, and
  // sharper to find it exactly.
  const double lidar_sigma_px = lidar.sigma_rad * intrinsics.fx_px;
  const double coarse_px = std::max(1.0, 0.8 * lidar_sigma_px);
  const double fine_px = std::max(1.0, 0.25 * lidar_sigma_px);
  ImageEdges image(grey, coarse_px);
  if (image.ridges().size() < kMinImageEdges) return CalibrationStatus::kNoImageEdges;
  std::vector<EdgeField> fields;
  for (const double level_deg : kLevels_deg) {
    if (stop.stop_requested()) return CalibrationStatus::kCancelled;
    const double sigma_px = std::max(level_deg * kDegree * intrinsics.fx_px, coarse_px);
    if (!fields.empty() && fields.back().sigma_px() == sigma_px) {
      fields.push_back(fields.back());  // shares its memory
    } else {
      fields.emplace_back(image.ridges(), grey.size(), sigma_px);
    }
  }
  if (fine_px < coarse_px) image = ImageEdges(grey, fine_px);
  prepared.push_back({std::move(lidar), std::move(image), std::move(fields), {}, {}, 0});
  lay_chessboard(view, prepared.back());
  return CalibrationStatus::kDone;
}

}  // namespace

LidarView view_of(const sensors::CameraIntrinsics& intrinsics,
                  const geometry::SE3& T_camera_lidar,
                  double margin_rad) {
  const auto half = [margin_rad](double centre_px, int size_px, double focal_px) {
    return std::atan2(std::max(centre_px, size_px - centre_px), focal_px) + margin_rad;
  };
  return {T_camera_lidar.rotation().matrix(),
          half(intrinsics.cx_px, intrinsics.width_px, intrinsics.fx_px),
          half(intrinsics.cy_px, intrinsics.height_px, intrinsics.fy_px),
          1.0 / intrinsics.fx_px};
}

Preparation prepare(const std::vector<Scene>& scenes,
                    const sensors::CameraIntrinsics& intrinsics,
                    const geometry::SE3& T_camera_lidar_guess,
                    const CalibrationConfig& config,
                    const std::stop_token& stop) {
  Preparation preparation;
  if (scenes.empty()) return {CalibrationStatus::kNoScene, {}};
  const LidarView view =
      view_of(intrinsics, T_camera_lidar_guess, (config.max_rotation_deg + 1.0) * kDegree);
  LidarEdgeConfig edges = config.lidar_edges;
  edges.max_edges =
      std::max(std::min(edges.max_edges, 1000), edges.max_edges / static_cast<int>(scenes.size()));
  for (const Scene& scene : scenes) {
    if (stop.stop_requested()) return {CalibrationStatus::kCancelled, {}};
    const auto status = prepare_one(scene, intrinsics, view, edges, stop, preparation.scenes);
    if (status != CalibrationStatus::kDone) return {status, {}};
  }
  return preparation;
}

}  // namespace camvox::calibration
