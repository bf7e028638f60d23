#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "camvox/depth/sample_depth.hpp"
#include "camvox/features/feature_extractor.hpp"
#include "camvox/import/seven_scenes.hpp"
#include "camvox/optimization/point_observation.hpp"
#include "camvox/tracking/keyframe.hpp"
#include "camvox/trajectory/trajectory_file.hpp"

namespace camvox::bench {

/// The frames of 7-Scenes RedKitchen with their true poses, for whoever wants to look for one in
/// the others.
struct RedKitchen {
  explicit RedKitchen(const std::filesystem::path& folder) {
    features::FeatureExtractor extractor({.features = 1000});
    const auto& c = options_.rig.camera;
    camera = {c.fx_px, c.fy_px, c.cx_px, c.cy_px, 0.05};
    for (std::uint64_t i = 0; i < 100000; ++i) {
      char name[32];
      std::snprintf(name, sizeof(name), "frame-%06d", static_cast<int>(i));
      const auto path = (folder / name).string();
      const cv::Mat grey = cv::imread(path + ".color.jpg", cv::IMREAD_GRAYSCALE);
      const cv::Mat depth = cv::imread(path + ".depth.png", cv::IMREAD_UNCHANGED);
      if (grey.empty() || depth.empty()) break;
      tracking::Keyframe frame;
      frame.frame_id = i + 1;
      extractor.extract({grey.data, grey.cols, grey.rows, static_cast<std::ptrdiff_t>(grey.step)},
                        frame.features);
      add_depth(depth, frame.features);
      frame.T_map_camera = read_pose(path + ".pose.txt");
      frames.push_back(std::move(frame));
    }
  }

  /// Takes the poses of another trajectory for true, e.g. of a run through the whole sequence.
  /// False when it does not have all frames.
  [[nodiscard]] bool take_poses(const std::filesystem::path& tum) {
    const auto trajectory = trajectory::read_tum(tum);
    if (!trajectory.ok() || trajectory->size() != frames.size()) return false;
    for (std::size_t i = 0; i < frames.size(); ++i)
      frames[i].T_map_camera = (*trajectory)[i].T_world_body;
    return true;
  }

  std::vector<tracking::Keyframe> frames;
  optimization::PinholeCamera camera;

 private:
  void add_depth(const cv::Mat& depth, features::FrameFeatures& features) const {
    const auto& camera_size = options_.rig.camera;
    const auto depth_mm =
        import::register_depth(options_.rig, {depth.ptr<std::uint16_t>(), depth.total()});
    std::vector<float> depth_m(depth_mm.size()), sigma_m(depth_mm.size());
    for (std::size_t i = 0; i < depth_mm.size(); ++i) {
      depth_m[i] = 1e-3F * static_cast<float>(depth_mm[i]);
      sigma_m[i] = 0.003F + 0.003F * depth_m[i] * depth_m[i];  // Khoshelham, Elberink 2012
    }
    const depth::DepthView view{
        depth_m.data(), sigma_m.data(), camera_size.width_px, camera_size.height_px};
    for (const auto& point : features.key_points) {
      const auto sample = depth::sample_depth(view, point.u_px, point.v_px, 2);
      features.undistorted_px.emplace_back(point.u_px, point.v_px);
      features.depth_m.push_back(sample.depth_m);
      features.depth_sigma_m.push_back(sample.sigma_m);
    }
  }

  [[nodiscard]] geometry::SE3 read_pose(const std::string& path) const {
    Eigen::Matrix4d T_map_depth;
    std::ifstream text(path);
    for (int k = 0; k < 16; ++k) text >> T_map_depth(k / 4, k % 4);
    const Eigen::Quaterniond q(Eigen::Matrix3d(T_map_depth.topLeftCorner<3, 3>()));
    const geometry::SE3 T(geometry::SO3(q.normalized()), T_map_depth.topRightCorner<3, 1>());
    const Eigen::Vector3d p_camera_depth =
        Eigen::Vector3d::Map(options_.rig.p_camera_depth_m.data());
    return T * geometry::SE3({}, p_camera_depth).inverse();
  }

  import::SevenScenesOptions options_;
};

}  // namespace camvox::bench
