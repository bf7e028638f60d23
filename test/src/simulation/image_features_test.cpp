#include <gmock/gmock.h>

#include <iostream>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "camvox/simulation/simulator.hpp"

namespace camvox::simulation {
namespace {

/// How well ORB matches two views of a scene that does not move.
struct MatchStatistics {
  int keypoints = 0;
  int matches = 0;       ///< Mutual nearest neighbours with ratio 0.8.
  double inliers = 0.0;  ///< Share of the matches that fit one essential matrix within 1 px.
  double median_distance = 0.0;  ///< Of the descriptors of the inliers, bits of 256.
};

MatchStatistics match(const cv::Mat& a, const cv::Mat& b, const cv::Matx33d& K) {
  const auto orb = cv::ORB::create(1500, 1.2f, 8, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31, 20);
  std::vector<cv::KeyPoint> keys_a, keys_b;
  cv::Mat descriptors_a, descriptors_b;
  orb->detectAndCompute(a, {}, keys_a, descriptors_a);
  orb->detectAndCompute(b, {}, keys_b, descriptors_b);
  std::vector<std::vector<cv::DMatch>> pairs;
  cv::BFMatcher(cv::NORM_HAMMING).knnMatch(descriptors_a, descriptors_b, pairs, 2);
  std::vector<cv::Point2f> points_a, points_b;
  std::vector<double> distances;
  for (const auto& pair : pairs) {
    if (pair.size() < 2 || pair[0].distance > 0.8f * pair[1].distance) continue;
    points_a.push_back(keys_a[static_cast<std::size_t>(pair[0].queryIdx)].pt);
    points_b.push_back(keys_b[static_cast<std::size_t>(pair[0].trainIdx)].pt);
    distances.push_back(static_cast<double>(pair[0].distance));
  }
  MatchStatistics result{
      static_cast<int>(keys_a.size()), static_cast<int>(points_a.size()), 0.0, 0.0};
  if (points_a.size() < 8) return result;
  cv::setRNGSeed(1);
  cv::Mat mask;
  cv::findEssentialMat(points_a, points_b, K, cv::RANSAC, 0.999, 1.0, mask);
  std::vector<double> good;
  for (int i = 0; i < mask.rows; ++i) {
    if (mask.at<std::uint8_t>(i) != 0) good.push_back(distances[static_cast<std::size_t>(i)]);
  }
  result.inliers = static_cast<double>(good.size()) / static_cast<double>(points_a.size());
  if (good.empty()) return result;
  std::nth_element(
      good.begin(), good.begin() + static_cast<std::ptrdiff_t>(good.size() / 2), good.end());
  result.median_distance = good[good.size() / 2];
  return result;
}

void print(const std::string& name, const MatchStatistics& s) {
  std::cout << name << ": " << s.keypoints << " key points, " << s.matches << " matches, "
            << 100 * s.inliers << " % inliers, median distance " << s.median_distance << " bits\n";
}

/// The rendered views of a drive, `step_m` apart, as grey images without lens distortion.
std::vector<cv::Mat> rendered_views(const std::string& world_kind, double step_m, int count) {
  SimulationOptions options = preset("loop_400m");
  options.world.kind = world_kind;
  options.world.people = options.world.cars = 0;
  options.intrinsics.distortion = {};
  options.motion = "given";
  options.scans = false;
  options.duration_s = 0.1 * (count - 1) + 0.05;
  std::vector<TimedPose> poses;
  const Eigen::Vector3d start =
      world_kind == "campus" ? Eigen::Vector3d(12, -1.2, 0) : Eigen::Vector3d(-25, -8, 0);
  for (int i = 0; i < 40; ++i) {
    poses.push_back({0.1 * i, {geometry::SO3(), start + Eigen::Vector3d(step_m * i, 0, 0)}});
  }
  Simulator simulator(options, 2, follow_poses(poses, 0.1));
  std::vector<cv::Mat> views;
  while (auto event = simulator.next()) {
    auto* frame = std::get_if<SimulatedFrame>(&event->message);
    if (frame == nullptr) continue;
    const cv::Mat rgb(
        frame->image.height_px, frame->image.width_px, CV_8UC3, frame->image.rgb.data());
    cv::Mat grey;
    cv::cvtColor(rgb, grey, cv::COLOR_RGB2GRAY);
    views.push_back(grey);
  }
  return views;
}

MatchStatistics mean_of(const std::vector<cv::Mat>& views, const cv::Matx33d& K) {
  MatchStatistics mean;
  const int count = static_cast<int>(views.size()) - 1;
  for (int i = 0; i < count; ++i) {
    const auto s =
        match(views[static_cast<std::size_t>(i)], views[static_cast<std::size_t>(i) + 1], K);
    mean.keypoints += s.keypoints / count;
    mean.matches += s.matches / count;
    mean.inliers += s.inliers / count;
    mean.median_distance += s.median_distance / count;
  }
  return mean;
}

TEST(ImageFeatures, MatchAsOnRealPhotographs) {
  const sensors::CameraIntrinsics rig;
  const cv::Matx33d K_rig(rig.fx_px, 0, rig.cx_px, 0, rig.fy_px, rig.cy_px, 0, 0, 1);
  const auto campus = mean_of(rendered_views("campus", 1.2, 5), K_rig);
  const auto plaza = mean_of(rendered_views("plaza", 1.2, 5), K_rig);
  print("campus, 1.2 m per view", campus);
  print("plaza, 1.2 m per view", plaza);
  for (const auto& rendered : {campus, plaza}) {
    EXPECT_GT(rendered.keypoints, 1300);
    EXPECT_GT(rendered.inliers, 0.5);
  }
  std::vector<cv::Mat> kitti;
  for (int i = 20; i < 28; ++i) {
    const std::string path =
        std::string(SHARED_DATA) +
        cv::format("/kitti_0013/2011_09_26_drive_0013_sync/image_02/data/%010d.jpg", i);
    const cv::Mat view = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (!view.empty()) kitti.push_back(view);
  }
  if (kitti.size() < 2) GTEST_SKIP() << "no KITTI frames in " << SHARED_DATA;
  const auto real = mean_of(kitti, cv::Matx33d(721.54, 0, 609.56, 0, 721.54, 172.85, 0, 0, 1));
  print("KITTI 0013, 1.2 m per view", real);
  // Loosely: another scene, another camera. A factor of 2.5 either way in the share of key points
  // that match, and inliers within 25 points of a hundred, still means "behaves like a photograph".
  for (const auto& rendered : {campus, plaza}) {
    const double ratio = static_cast<double>(rendered.matches) / rendered.keypoints /
                         (static_cast<double>(real.matches) / real.keypoints);
    EXPECT_GT(ratio, 0.4);
    EXPECT_LT(ratio, 2.5);
    EXPECT_NEAR(rendered.inliers, real.inliers, 0.25);
  }
}

}  // namespace
}  // namespace camvox::simulation
