#include "camvox/calibration/overlay.hpp"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "camvox/sensors/camera_model.hpp"
#include "prepare.hpp"

namespace camvox::calibration {
namespace {

constexpr int kDetails = 3;      ///< Beside each other below the picture.
constexpr int kMagnify = 3;      ///< Of the details.
constexpr double kDim = 0.7;     ///< Of the image, so that edges stand out.
constexpr double kLength = 3.0;  ///< Of an edge to either side, px.

cv::Mat dimmed(const cv::Mat& image) {
  cv::Mat picture;
  cv::cvtColor(to_grey(image), picture, cv::COLOR_GRAY2BGR);
  picture *= kDim;
  return picture;
}

/// An edge as a line across a picture magnified `scale` times, whose first pixel is `origin`.
struct Line {
  cv::Point2d middle;
  cv::Point2d along;
  cv::Scalar colour;
  double strength = 0.0;

  void draw(cv::Mat& picture, cv::Point2d origin, double scale) const {
    constexpr int kShift = 4;  // of OpenCV's coordinates with fractions
    const auto at = [&](double side) {
      const cv::Point2d p =
          (middle + side * kLength * along - origin + cv::Point2d(0.5, 0.5)) * scale -
          cv::Point2d(0.5, 0.5);
      return cv::Point(cvRound(p.x * (1 << kShift)), cvRound(p.y * (1 << kShift)));
    };
    cv::line(picture, at(-1.0), at(1.0), colour, scale > 1.0 ? 2 : 1, cv::LINE_AA, kShift);
  }
};

std::vector<Line> project_edges(const LidarEdges& lidar,
                                const sensors::CameraModel& camera,
                                const geometry::SE3& T_camera_lidar) {
  std::vector<Line> lines;
  for (const LidarEdge& edge : lidar.edges) {
    const auto u_px = camera.project(T_camera_lidar * edge.p_lidar);
    const auto next_px = camera.project(
        T_camera_lidar * (edge.p_lidar + 1e-3 * edge.p_lidar.norm() * edge.tangent_lidar));
    if (!u_px || !next_px || !camera.contains(*u_px, 1.0)) continue;
    const Eigen::Vector2d along = (*next_px - *u_px).normalized();
    if (!along.allFinite()) continue;
    const bool depth = edge.kind != EdgeKind::kReflectivity;
    lines.push_back({{u_px->x(), u_px->y()},
                     {along.x(), along.y()},
                     depth ? cv::Scalar(60, 60, 255) : cv::Scalar(60, 255, 60),
                     static_cast<double>(edge.strength)});
  }
  return lines;
}

/// The window of that size, between two columns, with most and strongest lines. On a coarse raster,
/// so that it is the same before and after.
cv::Rect busiest(const std::vector<Line>& lines, cv::Range columns, int rows, cv::Size size) {
  cv::Rect best(columns.start, 0, size.width, size.height);
  double most = -1.0;
  for (int y = 0; y + size.height <= rows; y += size.height / 2) {
    for (int x = columns.start; x + size.width <= columns.end; x += size.width / 2) {
      const cv::Rect2d window(x, y, size.width, size.height);
      double sum = 0.0;
      for (const Line& line : lines) sum += window.contains(line.middle) ? line.strength : 0.0;
      if (sum <= most) continue;
      most = sum;
      best = cv::Rect(x, y, size.width, size.height);
    }
  }
  return best;
}

}  // namespace

cv::Mat draw_overlay(const Scene& scene,
                     const sensors::CameraIntrinsics& intrinsics,
                     const geometry::SE3& T_camera_lidar,
                     const LidarEdgeConfig& config) {
  const cv::Mat image = dimmed(scene.image);
  const LidarEdges lidar =
      extract_lidar_edges(scene.points_lidar, view_of(intrinsics, T_camera_lidar, 0.1), config);
  const auto lines = project_edges(lidar, sensors::CameraModel(intrinsics), T_camera_lidar);
  const int wide = image.cols / kDetails;
  const cv::Size detail(wide / kMagnify, std::min(image.rows, wide / kMagnify * 2 / 3));
  cv::Mat picture(image.rows + kMagnify * detail.height, image.cols, CV_8UC3, cv::Scalar::all(0));
  cv::Mat upper = picture.rowRange(0, image.rows);
  image.copyTo(upper);
  for (const Line& line : lines) line.draw(upper, {0.0, 0.0}, 1.0);
  if (detail.width < 8 || detail.height < 8) return picture;
  for (int i = 0; i < kDetails; ++i) {
    const cv::Rect window = busiest(lines, {i * wide, (i + 1) * wide}, image.rows, detail);
    cv::Mat lower =
        picture({i * wide, image.rows, kMagnify * detail.width, kMagnify * detail.height});
    cv::resize(image(window), lower, lower.size(), 0.0, 0.0, cv::INTER_LINEAR);
    for (const Line& line : lines) line.draw(lower, window.tl(), kMagnify);
    cv::rectangle(lower, {{0, 0}, lower.size()}, cv::Scalar::all(255));
    cv::rectangle(upper, window, cv::Scalar::all(255));
  }
  return picture;
}

}  // namespace camvox::calibration
