#include "camvox/trajectory/keyframe_path.hpp"

#include <gtest/gtest.h>

namespace camvox::trajectory {
namespace {

using geometry::SE3;
using geometry::SO3;

SE3 at(double x, double yaw = 0.0) { return {SO3::exp({0.0, 0.0, yaw}), {x, 0.0, 0.0}}; }

std::vector<double> x_of(const Trajectory& trajectory) {
  std::vector<double> values;
  for (const auto& pose : trajectory) values.push_back(pose.T_world_body.translation().x());
  return values;
}

/// Keyframes 1 and 2 at 0 m and 10 m; frames 1 m and 3 m behind the first, 2 m behind the second.
KeyframePath path() {
  KeyframePath path;
  path.add_keyframe(1, 0, at(0.0));
  path.add_keyframe(2, 20, at(10.0));
  path.add_frame({1, 1, at(1.0)});
  path.add_frame({3, 1, at(3.0)});
  path.add_frame({22, 2, at(2.0)});
  return path;
}

TEST(KeyframePath, FramesFollowTheirKeyframe) {
  auto moved = path();
  EXPECT_EQ(x_of(moved.frames()), (std::vector<double>{1.0, 3.0, 12.0}));
  moved.move_keyframe(2, at(20.0));
  EXPECT_EQ(x_of(moved.frames()), (std::vector<double>{1.0, 3.0, 22.0}));
  EXPECT_EQ(x_of(moved.keyframes()), (std::vector<double>{0.0, 20.0}));
}

TEST(KeyframePath, FramesOfARemovedKeyframeHangOnAnother) {
  auto culled = path();
  culled.move_keyframe(2, at(10.0, 0.5));
  const auto before = culled.frames();
  culled.remove_keyframe(2);
  ASSERT_EQ(culled.keyframes().size(), 1U);
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_LT(geometry::local(before[i].T_world_body, culled.frames()[i].T_world_body).norm(),
              1e-12);
  }
  culled.move_keyframe(1, at(5.0));
  EXPECT_NEAR(x_of(culled.frames())[2], before[2].T_world_body.translation().x() + 5.0, 1e-12);
}

TEST(KeyframePath, TheFirstMayGoToo) {
  auto culled = path();
  culled.remove_keyframe(1);
  EXPECT_EQ(x_of(culled.frames()), (std::vector<double>{1.0, 3.0, 12.0}));
  culled.remove_keyframe(2);
  EXPECT_EQ(culled.frames().size(), 3U) << "the last one stays: frames need something to hang on";
}

TEST(KeyframePath, UnknownKeyframesAndOldFramesAreLeftOut) {
  auto odd = path();
  odd.add_frame({22, 1, at(0.0)});
  odd.add_frame({23, 9, at(0.0)});
  odd.move_keyframe(7, at(1.0));
  odd.remove_keyframe(7);
  EXPECT_EQ(odd.frames().size(), 3U);
  EXPECT_TRUE(KeyframePath().frames().empty());
}

TEST(KeyframePath, WhatTrackingSaidStandsInForAnUnknownKeyframe) {
  auto front_end = path();
  front_end.add_frame({23, 9, at(0.0), at(7.0)});
  EXPECT_EQ(x_of(front_end.frames()), (std::vector<double>{1.0, 3.0, 12.0, 7.0}));
  front_end.add_keyframe(9, 23, at(8.0));
  EXPECT_EQ(x_of(front_end.frames()), (std::vector<double>{1.0, 3.0, 12.0, 8.0}));
}

}  // namespace
}  // namespace camvox::trajectory
