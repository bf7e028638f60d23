#include "camvox/conversion/map_messages.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace camvox::conversion {
namespace {

namespace msg = camvox_interfaces::msg;

geometry::SE3 some_pose(double x) { return {geometry::SO3::exp({0.1, -0.2, 0.3}), {x, 2.0, 3.0}}; }

tracking::Keyframe some_keyframe() {
  tracking::Keyframe keyframe;
  keyframe.id = 7;
  keyframe.frame_id = 70;
  keyframe.stamp_ns = 700;
  keyframe.map_epoch = 3;
  keyframe.parent_id = 6;
  keyframe.T_map_camera = some_pose(1.0);
  keyframe.T_parent_camera = some_pose(0.5);
  keyframe.covariance_camera.diagonal().setConstant(0.25);
  for (std::size_t i = 0; i < 3; ++i) {
    keyframe.features.key_points.push_back({static_cast<float>(i), 1.0F, 0.0F, 0.0F, 2});
    keyframe.features.undistorted_px.emplace_back(static_cast<float>(i), 2.0F);
    keyframe.features.descriptors.emplace_back();
    keyframe.features.depth_m.push_back(5.0F);
    keyframe.features.depth_sigma_m.push_back(0.1F);
    keyframe.landmark_ids.push_back(tracking::landmark_id(7, i));
  }
  return keyframe;
}

TEST(MapMessages, AKeyframeReadsBack) {
  const auto message = std::make_unique<msg::Keyframe>();
  const auto written = some_keyframe();
  ASSERT_TRUE(write_keyframe(written, *message));
  const auto read = read_keyframe(*message);
  EXPECT_EQ(read.id, 7U);
  EXPECT_EQ(read.frame_id, 70U);
  EXPECT_EQ(read.stamp_ns, 700);
  EXPECT_EQ(read.map_epoch, 3U);
  EXPECT_EQ(read.parent_id, 6U);
  EXPECT_EQ(read.landmark_ids, written.landmark_ids);
  EXPECT_EQ(read.covariance_camera, written.covariance_camera);
  EXPECT_LT(geometry::local(read.T_map_camera, written.T_map_camera).norm(), 1e-12);
  EXPECT_LT(geometry::local(read.T_parent_camera, written.T_parent_camera).norm(), 1e-12);
}

TEST(MapMessages, ALocalMapReadsBackAndIsCutAtItsCapacity) {
  tracking::LocalMap map;
  map.frame_id = 5;
  map.map_epoch = 2;
  map.reference_keyframe_id = 1;
  map.next_keyframe_id = 9;
  map.keyframes = {{1, some_pose(1.0)}, {2, some_pose(2.0)}};
  for (std::size_t i = 0; i < msg::LOCAL_MAP_LANDMARKS + 10; ++i) {
    tracking::Landmark landmark;
    landmark.id = i + 1;
    landmark.p_map = {1.0, 2.0, static_cast<double>(i)};
    landmark.f_map = {0.0F, 0.0F, 1.0F};
    landmark.min_distance_m = 1.0F;
    landmark.max_distance_m = 4.0F;
    landmark.sigma_m = 0.5F;
    map.landmarks.push_back(landmark);
  }
  const auto message = std::make_unique<msg::LocalMap>();
  EXPECT_EQ(write_local_map(map, *message), 10U) << "so many are left out";
  const auto read = read_local_map(*message);
  EXPECT_EQ(read.frame_id, 5U);
  EXPECT_EQ(read.map_epoch, 2U);
  EXPECT_EQ(read.next_keyframe_id, 9U);
  ASSERT_EQ(read.keyframes.size(), 2U);
  EXPECT_EQ(read.keyframes[1].id, 2U);
  ASSERT_EQ(read.landmarks.size(), std::size_t{msg::LOCAL_MAP_LANDMARKS});
  EXPECT_EQ(read.landmarks[12].p_map.z(), 12.0);
  EXPECT_EQ(read.landmarks[12].max_distance_m, 4.0F);
  EXPECT_EQ(read.landmarks[12].sigma_m, 0.5F);
}

TEST(MapMessages, ContradictionsAreRefused) {
  const auto map = std::make_unique<msg::LocalMap>();
  map->landmark_ids_count(1);
  EXPECT_THROW((void)read_local_map(*map), std::invalid_argument);
  const auto keyframe = std::make_unique<msg::Keyframe>();
  EXPECT_THROW((void)read_keyframe(*keyframe), std::logic_error) << "a pose that nobody filled";
}

TEST(MapMessages, AFramePoseCarriesStateAndCounts) {
  tracking::FrameResult result;
  result.state = tracking::TrackingState::kLost;
  result.frame_id = 4;
  result.statistics.inliers = 55;
  result.velocity_camera = {1.0, 2.0, 3.0};
  msg::FramePose message;
  write_frame_pose(result, message);
  EXPECT_EQ(message.state(), msg::TRACKING_LOST);
  EXPECT_EQ(message.header().frame_id(), 4U);
  EXPECT_EQ(message.inliers(), 55U);
  EXPECT_EQ(message.velocity_camera()[2], 3.0);
}

}  // namespace
}  // namespace camvox::conversion
