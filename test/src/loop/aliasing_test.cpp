#include <gtest/gtest.h>

#include <random>

#include "camvox/depth/sample_depth.hpp"
#include "camvox/features/feature_extractor.hpp"
#include "camvox/features/undistorter.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "camvox/simulation/camera_renderer.hpp"
#include "palette.hpp"
#include "props.hpp"

// Perceptual aliasing on images: a street whose houses are all the same, drawn, and through
// features, place index, verification and consistency. Whatever looks alike there is another
// place: any loop is false.
namespace camvox::loop {
namespace {

using Eigen::Vector3f;
using geometry::SE3;
using geometry::SO3;

constexpr float kHouse_m = 12.0F;
constexpr int kHouses = 9;
constexpr float kHalfStreet_m = 6.0F;
constexpr double kStep_m = 1.5;

simulation::World street() {
  simulation::World world;
  world.materials = simulation::make_palette();
  simulation::Mesh house;
  simulation::SequentialRandom random(3, 1);
  const auto style = simulation::random_style(random);
  const simulation::FacadePlan left = {{0, kHalfStreet_m, 0}, {1, 0, 0}, kHouse_m, 9.0F};
  const simulation::FacadePlan right = {{kHouse_m, -kHalfStreet_m, 0}, {-1, 0, 0}, kHouse_m, 9.0F};
  simulation::add_facade(left, style, random, house);
  simulation::add_facade(right, style, random, house);
  house.add_quad({0, -kHalfStreet_m, 0},
                 {kHouse_m, 0, 0},
                 {0, 2 * kHalfStreet_m, 0},
                 simulation::palette::kSidewalk);
  for (int i = 0; i < kHouses; ++i) {
    world.scenery.append(house, {kHouse_m * static_cast<float>(i), 0, 0}, 0.0F);
  }
  return world;
}

sensors::CameraIntrinsics small_camera() {
  sensors::CameraIntrinsics camera;
  camera.width_px = 640;
  camera.height_px = 320;
  camera.fx_px = camera.fy_px = 400.0;
  camera.cx_px = 320.0;
  camera.cy_px = 200.0;
  camera.distortion = {};
  return camera;
}

class AliasingTest : public testing::Test {
 protected:
  static constexpr int kSteps = static_cast<int>((kHouses - 2) * kHouse_m / kStep_m);

  /// The camera after `i` steps: down the middle of the street, turned 0.5 rad to the left; from
  /// kSteps on back again, turned to the right, to the same houses.
  static SE3 truth(int i) {
    Eigen::Matrix3d R_world_camera;
    R_world_camera << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    const bool back = i > kSteps;
    const double yaw = back ? M_PI - 0.5 : 0.5;
    const double x = 2.0 + kStep_m * (back ? 2 * kSteps - i : i);
    return SE3(SO3::from_matrix(R_world_camera) * SO3::exp({0.0, -yaw, 0.0}), {x, 0.0, 1.5});
  }

  features::FrameFeatures look(int i) {
    simulation::CameraMotion motion;
    motion.index = static_cast<std::uint64_t>(i);
    motion.T_world_camera = [i](double) { return truth(i); };
    const auto seen = renderer_.render(scene_, motion, 2);
    std::vector<std::uint8_t> grey(seen.image.rgb.size() / 3);
    for (std::size_t k = 0; k < grey.size(); ++k) grey[k] = seen.image.rgb[3 * k + 1];
    features::FrameFeatures features;
    extractor_.extract({grey.data(), seen.image.width_px, seen.image.height_px, 640}, features);
    undistorter_.undistort(features);
    const std::vector<float> sigma_m(seen.depth.z_m.size(), 0.02F);
    const depth::DepthView depth{seen.depth.z_m.data(), sigma_m.data(), 640, 320};
    for (const auto& point : features.key_points) {
      const auto sample = depth::sample_depth(depth, point.u_px, point.v_px, 2);
      features.depth_m.push_back(sample.depth_m);
      features.depth_sigma_m.push_back(sample.sigma_m);
    }
    return features;
  }

  /// Odometry that measures 1 % too long and turns a little.
  void drive_to(int i) {
    tracking::Keyframe keyframe;
    keyframe.id = static_cast<std::uint64_t>(i) + 1;
    keyframe.parent_id = static_cast<std::uint64_t>(i);
    keyframe.features = look(i);
    const SE3 step = i == 0 ? truth(0) : truth(i - 1).inverse() * truth(i);
    keyframe.T_map_camera =
        i == 0 ? step
               : T_map_camera_ * step * SE3(SO3::exp({0, 4e-4, 0}), 0.01 * step.translation());
    T_map_camera_ = keyframe.T_map_camera;
    closer_.insert(keyframe);
    const auto task = closer_.detect(keyframe.id);
    const auto places = verify(task, pinhole_, closer_.config());
    for (const auto& place : places) {
      if (place.by_surfaces) look_at(place, i);
    }
    EXPECT_FALSE(closer_.consider(keyframe.id, places)) << "at " << i;
  }

  void look_at(const VerifiedPlace& place, int i) {
    const SE3 T_match_query = truth(static_cast<int>(place.match_id) - 1).inverse() * truth(i);
    const auto error = geometry::local(T_match_query, place.verification.T_place_query);
    const bool wrong = error.tail<3>().norm() > 0.5 || error.head<3>().norm() > 0.05;
    const bool confirmed = place.verification.status == VerificationStatus::kOk;
    wrong_surfaces_ += wrong && confirmed ? 1 : 0;
  }

  simulation::World world_ = street();
  simulation::SurfaceShader shader_{1, 2};
  simulation::RayScene scene_{world_};
  sensors::CameraModel camera_{small_camera()};
  simulation::CameraRenderer renderer_{camera_, {}, world_, shader_};
  features::FeatureExtractor extractor_{{.features = 800}};
  features::Undistorter undistorter_{camera_};
  optimization::PinholeCamera pinhole_{400.0, 400.0, 320.0, 200.0, 0.05};
  LoopCloser closer_{LoopCloserConfig()};
  SE3 T_map_camera_;
  int wrong_surfaces_ = 0;
};

TEST_F(AliasingTest, IdenticalHousesAreNoLoop) {
  for (int i = 0; i < kSteps; ++i) drive_to(i);
  // They do look alike: geometry alone would take them for one place.
  EXPECT_GT(closer_.statistics().places_confirmed, 10U);
  EXPECT_TRUE(closer_.loops().empty());
  EXPECT_EQ(closer_.statistics().corrections, 0U);

  // A lost tracker may be in front of any of them: no answer, or the right one.
  int wrong = 0;
  for (const int i : {17, 26, 35}) {
    const auto frame = std::make_shared<features::FrameFeatures>(look(i));
    const auto answer =
        closer_.relocalise(verify(closer_.detect_lost(frame), pinhole_, closer_.config()));
    if (!answer) continue;
    const auto best = static_cast<int>(answer->keyframe_ids.front()) - 1;
    wrong += std::abs(best - i) * kStep_m < 0.5 * kHouse_m ? 0 : 1;
  }
  EXPECT_EQ(wrong, 0);
}

// Seen from the other end, without the help of images: what stands around is the same a house or a
// window farther.
TEST_F(AliasingTest, IdenticalHousesAreNoWayBack) {
  LoopCloserConfig config;
  config.verification.min_inliers = 100000;
  closer_ = LoopCloser(config);
  for (int i = 0; i <= 2 * kSteps; ++i) drive_to(i);
  EXPECT_GT(closer_.statistics().surfaces_compared, 5U);
  EXPECT_EQ(wrong_surfaces_, 0);
  EXPECT_TRUE(closer_.loops().empty());
}

}  // namespace
}  // namespace camvox::loop
