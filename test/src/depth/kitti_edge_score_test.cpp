#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <numbers>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "camvox/depth/depth_projector.hpp"

namespace camvox::depth {
namespace {

/// KITTI raw drive 0013 as it lies on disk: colour images, sweeps, and its own calibration.
class Kitti {
 public:
  explicit Kitti(const std::filesystem::path& folder) : drive_(folder / kDrive) {
    const auto R = numbers(folder / "calib_velo_to_cam.txt", "R:");
    const auto t = numbers(folder / "calib_velo_to_cam.txt", "T:");
    const auto R_rect = numbers(folder / "calib_cam_to_cam.txt", "R_rect_00:");
    const auto P = numbers(folder / "calib_cam_to_cam.txt", "P_rect_02:");
    intrinsics_.width_px = 1242;
    intrinsics_.height_px = 375;
    intrinsics_.fx_px = P[0];
    intrinsics_.fy_px = P[5];
    intrinsics_.cx_px = P[2];
    intrinsics_.cy_px = P[6];
    intrinsics_.distortion_model = "plumb_bob";
    intrinsics_.distortion.assign(5, 0.0);
    const geometry::SE3 T_cam0_lidar(rotation(R), {t[0], t[1], t[2]});
    const geometry::SE3 T_cam2_rect(geometry::SO3(), {P[3] / P[0], P[7] / P[5], P[11]});
    T_camera_lidar =
        T_cam2_rect * geometry::SE3(rotation(R_rect), Eigen::Vector3d::Zero()) * T_cam0_lidar;
  }

  [[nodiscard]] sensors::CameraModel camera() const { return sensors::CameraModel(intrinsics_); }
  [[nodiscard]] cv::Mat image(int frame) const {
    return cv::imread(path("image_02", frame, ".jpg"), cv::IMREAD_GRAYSCALE);
  }
  [[nodiscard]] std::vector<float> points_lidar(int frame) const {
    std::ifstream file(path("velodyne_points", frame, ".bin"), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(file)), {});
    std::vector<float> points(bytes.size() / sizeof(float));
    std::memcpy(points.data(), bytes.data(), points.size() * sizeof(float));
    return points;
  }

  geometry::SE3 T_camera_lidar;

 private:
  static constexpr const char* kDrive = "2011_09_26_drive_0013_sync";

  static std::vector<double> numbers(const std::filesystem::path& file, const std::string& key) {
    std::ifstream lines(file);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string word;
      if (!(words >> word) || word != key) continue;
      std::vector<double> values;
      for (double value = 0.0; words >> value;) values.push_back(value);
      return values;
    }
    return {};
  }
  static geometry::SO3 rotation(const std::vector<double>& rows) {
    Eigen::Matrix3d R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows.data());
    return geometry::SO3(Eigen::Quaterniond(R).normalized());
  }
  [[nodiscard]] std::string path(const char* sensor, int frame, const char* extension) const {
    std::string name = std::to_string(frame);
    name.insert(0, 10 - name.size(), '0');
    return drive_ / sensor / "data" / (name + extension);
  }

  std::filesystem::path drive_;
  sensors::CameraIntrinsics intrinsics_;
};

/// Near an edge across `axis` (0: u, 1: v) large, falling off over a few pixels (after Levinson and
/// Thrun, RSS 2013, who let edges shine on their surroundings so that near misses count, too); less
/// its mean around, or else the best place would be where the image has most texture.
cv::Mat edge_glow(const cv::Mat& image, int axis) {
  cv::Mat smooth;
  cv::GaussianBlur(image, smooth, {5, 5}, 1.0);
  cv::Mat across;
  cv::Sobel(smooth, across, CV_16S, axis == 0 ? 1 : 0, axis == 0 ? 0 : 1);
  const cv::Mat along = cv::Mat::zeros(image.size(), CV_16S);
  cv::Mat edges;
  cv::Canny(axis == 0 ? across : along, axis == 0 ? along : across, edges, 40, 100);
  cv::Mat distance_px;
  cv::distanceTransform(255 - edges, distance_px, cv::DIST_L2, cv::DIST_MASK_5);
  cv::Mat glow;
  cv::exp(-distance_px / 3.0, glow);
  cv::Mat around;
  cv::blur(glow, around, {41, 41});
  return glow - around;
}

/// Mean glow at the silhouettes: pixels with depth that have, to the left, right or above, none and
/// then a surface far behind.
class EdgeScore {
 public:
  void add(const std::array<cv::Mat, 2>& glows, const std::vector<float>& depth_m) {
    const int columns = glows[0].cols;
    for (int v = kReach_px; v < glows[0].rows; ++v) {
      for (int u = kReach_px; u < columns - kReach_px; ++u) {
        const float* at = &depth_m[static_cast<std::size_t>(v * columns + u)];
        for (const int step : {-1, 1, -columns}) {
          if (!is_silhouette(at, step)) continue;
          const bool above = step == -columns;
          const cv::Mat& glow = glows[above ? 1 : 0];
          sum_ += static_cast<double>(glow.at<float>(above ? v - kHalfRow_px : v, u));
          ++count_;
        }
      }
    }
  }
  [[nodiscard]] double mean() const { return sum_ / static_cast<double>(count_); }
  [[nodiscard]] int count() const { return count_; }

 private:
  static constexpr int kReach_px = 12;
  /// The Velodyne's rows are 5 px apart: upper ends lie half of that above the last one that hits.
  static constexpr int kHalfRow_px = 2;
  static bool is_silhouette(const float* at, int step) {
    if (!(at[0] > 0.0F) || at[step] > 0.0F) return false;
    for (int i = 2; i <= kReach_px; ++i) {
      const float z = at[i * step];
      if (z > 0.0F) return z > 1.3F * at[0];
    }
    return false;
  }

  double sum_ = 0.0;
  int count_ = 0;
};

class KittiEdgeScore : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(kFolder)) GTEST_SKIP() << "no recording at " << kFolder;
    const Kitti kitti(kFolder);
    for (int frame = 5; frame < 144; frame += 7) {
      glows_.push_back({edge_glow(kitti.image(frame), 0), edge_glow(kitti.image(frame), 1)});
      scans_.push_back(kitti.points_lidar(frame));
    }
    T_camera_lidar_ = kitti.T_camera_lidar;
    projector_ = std::make_unique<DepthProjector>(kitti.camera(), DepthProjectorConfig{});
  }

  EdgeScore score(const Eigen::Vector3d& turn_deg) {
    const geometry::SE3 turn(geometry::SO3::exp(turn_deg * std::numbers::pi / 180.0),
                             Eigen::Vector3d::Zero());
    EdgeScore score;
    for (std::size_t i = 0; i < scans_.size(); ++i) {
      std::vector<float> depth_m(glows_[i][0].total());
      std::vector<float> sigma_m(depth_m.size());
      const ScanView scan{scans_[i], turn * T_camera_lidar_};
      projector_->project({&scan, 1}, depth_m, sigma_m);
      score.add(glows_[i], depth_m);
    }
    return score;
  }

  static constexpr const char* kFolder = SHARED_DATA "/kitti_0013";
  std::vector<std::array<cv::Mat, 2>> glows_;  ///< Of edges across u, and across v.
  std::vector<std::vector<float>> scans_;
  geometry::SE3 T_camera_lidar_;
  std::unique_ptr<DepthProjector> projector_;
};

/// Edges of depth lie on edges of the image, and do so best with the extrinsics that KITTI gives.
TEST_F(KittiEdgeScore, IsLargestAtTheTrueExtrinsics) {
  const EdgeScore at_truth = score(Eigen::Vector3d::Zero());
  EXPECT_GT(at_truth.count(), 1'000);
  RecordProperty("at_truth", std::to_string(at_truth.mean()));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double turn_deg : {-1.0, -0.5, 0.5, 1.0}) {
      const EdgeScore turned = score(turn_deg * Eigen::Vector3d::Unit(axis));
      EXPECT_LT(turned.mean(), at_truth.mean())
          << "axis " << axis << ", " << turn_deg << " degrees";
      RecordProperty("axis_" + std::to_string(axis) + "_deg_" + std::to_string(turn_deg),
                     std::to_string(turned.mean()));
    }
  }
}

}  // namespace
}  // namespace camvox::depth
