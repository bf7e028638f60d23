#include "camvox/conversion/odometry_steps.hpp"

#include <gtest/gtest.h>

#include "camvox/conversion/pose.hpp"

namespace camvox::conversion {
namespace {

using camvox_interfaces::msg::FramePose;
using geometry::SE3;

FramePose pose_at(std::int64_t stamp_ns, double x_map_m, double x_keyframe_m) {
  FramePose pose;
  pose.header().stamp_ns(stamp_ns);
  pose.state(camvox_interfaces::msg::TRACKING_OK);
  pose.reference_keyframe_id(1);
  pose.T_map_camera(to_array(SE3({}, {x_map_m, 0.0, 0.0})));
  pose.T_keyframe_camera(to_array(SE3({}, {x_keyframe_m, 0.0, 0.0})));
  return pose;
}

TEST(OdometrySteps, PrefersThePoseInTheKeyframe) {
  OdometrySteps steps;
  EXPECT_FALSE(steps.add(pose_at(100, 5.0, 0.0)));
  const auto step = steps.add(pose_at(200, 9.0, 0.2));  // the map was moved in between
  ASSERT_TRUE(step);
  EXPECT_EQ(step->from_ns, 100);
  EXPECT_EQ(step->to_ns, 200);
  EXPECT_NEAR(step->T_from_to.translation().x(), 0.2, 1e-12);
}

TEST(OdometrySteps, UsesTheMapAcrossAChangeOfKeyframeInOneEpoch) {
  OdometrySteps steps;
  EXPECT_FALSE(steps.add(pose_at(100, 5.0, 3.0)));
  auto next = pose_at(200, 5.2, 0.0);
  next.reference_keyframe_id(2);
  const auto step = steps.add(next);
  ASSERT_TRUE(step);
  EXPECT_NEAR(step->T_from_to.translation().x(), 0.2, 1e-12);
  auto corrected = pose_at(300, 50.0, 0.0);
  corrected.reference_keyframe_id(3);
  corrected.map_epoch(1);
  EXPECT_FALSE(steps.add(corrected));
  EXPECT_TRUE(steps.tracked());
}

TEST(OdometrySteps, NoStepThroughALostFrameOrBackInTime) {
  OdometrySteps steps;
  EXPECT_FALSE(steps.add(pose_at(100, 0.0, 0.0)));
  EXPECT_FALSE(steps.add(pose_at(90, 0.0, 0.0)));
  FramePose lost;  // poses of a lost frame may be anything, even no rotation
  lost.header().stamp_ns(200);
  lost.state(camvox_interfaces::msg::TRACKING_LOST);
  EXPECT_FALSE(steps.add(lost));
  EXPECT_FALSE(steps.tracked());
  EXPECT_FALSE(steps.add(pose_at(300, 0.0, 0.0)));
  EXPECT_TRUE(steps.add(pose_at(400, 0.0, 0.0)));
}

TEST(OdometrySteps, FollowsAClockThatWasSetBack) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  OdometrySteps steps;
  EXPECT_FALSE(steps.add(pose_at(100 * kSecond_ns, 0.0, 0.0)));
  EXPECT_FALSE(steps.add(pose_at(10 * kSecond_ns, 0.0, 0.0)));
  EXPECT_TRUE(steps.add(pose_at(10 * kSecond_ns + 100, 0.0, 0.0)));
}

}  // namespace
}  // namespace camvox::conversion
