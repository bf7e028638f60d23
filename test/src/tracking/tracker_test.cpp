#include "camvox/tracking/tracker.hpp"

#include <random>

#include "tracker_fixture.hpp"

namespace camvox::tracking {
namespace {

// Landmarks are known to 2 cm of depth and 0.5 px, so 30 m of way over some 10 keyframes leaves
// some centimetres.
TEST_F(TrackerTest, FollowsADrive) {
  start();
  for (int i = 0; i <= 60; ++i) {
    step(at(0.5 * i));
    ASSERT_EQ(result_.state, TrackingState::kTracking) << i;
    ASSERT_LT(error_m(at(0.5 * i)), 0.05) << i;
  }
  EXPECT_GE(keyframes_, 3);
  EXPECT_LE(keyframes_, 40);
  EXPECT_NEAR(result_.velocity_camera.z(), 5.0, 0.3);
  EXPECT_GT(result_.statistics.inliers, 200);
  EXPECT_GT(result_.covariance_camera.determinant(), 0.0);
}

TEST_F(TrackerTest, FollowsADriveWithVirtualStereo) {
  TrackerConfig config;
  config.depth_model = "virtual_stereo";
  start(config);
  for (int i = 0; i <= 40; ++i) step(at(0.5 * i));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_LT(error_m(at(20.0)), 0.5);
}

TEST_F(TrackerTest, SameInputGivesTheSameBits) {
  std::vector<Eigen::Matrix4d> first;
  for (int run = 0; run < 2; ++run) {
    world_ = TunnelWorld();
    frame_id_ = 0;
    start();
    for (int i = 0; i < 15; ++i) {
      step(at(0.5 * i));
      const Eigen::Matrix4d T = result_.T_map_camera.matrix();
      if (run == 0) {
        first.push_back(T);
      } else {
        EXPECT_EQ(first[static_cast<std::size_t>(i)], T);
      }
    }
  }
}

// systems.md 1.A.9, 23: features without depth do not start a map, however many there are.
TEST_F(TrackerTest, StartsOnlyWithEnoughDepth) {
  start();
  TunnelWorld::View view;
  view.max_depth_m = 0.0;
  step(at(0.0), view);
  EXPECT_EQ(result_.state, TrackingState::kWaiting);
  EXPECT_FALSE(result_.keyframe);
  EXPECT_GT(result_.statistics.features, 400);
  step(at(0.0));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  ASSERT_TRUE(result_.keyframe);
  EXPECT_EQ(result_.keyframe->id, 1U);
  EXPECT_LT(error_m(SE3()), 1e-12);
}

TEST_F(TrackerTest, FindsItselfAgainAfterTwoBlackSeconds) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.3 * i));
  const SE3 T_odom_before = result_.T_odom_camera;
  for (int i = 0; i < 20; ++i) {
    step_blind();
    EXPECT_EQ(result_.state, TrackingState::kLost);
    EXPECT_FALSE(result_.keyframe);
  }
  // Meanwhile it has driven on by 3 m and turned by 20 degrees.
  step(at(9.0, 0.35));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_LT(error_m(at(9.0, 0.35)), 0.05);
  // Odometry does not jump: map -> odom takes what is not known of the way in between.
  EXPECT_LT(geometry::local(T_odom_before, result_.T_odom_camera).norm(), 1e-9);
}

TEST_F(TrackerTest, LosesHalfOfTheFrames) {
  start();
  for (int i = 0; i <= 60; i += 2) {
    step(at(0.4 * i));
    now_ns_ += kFrame_ns;
    ASSERT_EQ(result_.state, TrackingState::kTracking) << i;
  }
  EXPECT_LT(error_m(at(24.0)), 0.05);
}

TEST_F(TrackerTest, GoesOnWithoutDepthForThreeSeconds) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.1 * i));
  TunnelWorld::View blind;
  blind.max_depth_m = 0.0;
  for (int i = 21; i <= 50; ++i) {
    step(at(0.1 * i), blind);
    ASSERT_EQ(result_.state, TrackingState::kTracking) << i;
    EXPECT_EQ(result_.statistics.inliers_with_depth, 0);
    ASSERT_LT(error_m(at(0.1 * i)), 0.08) << i;
  }
  for (int i = 51; i <= 70; ++i) step(at(0.1 * i));
  EXPECT_LT(error_m(at(7.0)), 0.05);
}

TEST_F(TrackerTest, TurnsOnTheSpot) {
  start();
  for (int i = 0; i <= 90; ++i) {
    step(at(0.0, 0.07 * i));
    ASSERT_EQ(result_.state, TrackingState::kTracking) << i;
    ASSERT_LT(error_m(at(0.0)), 0.05) << i;
  }
  const SO3 R = result_.T_map_camera.rotation() * TunnelWorld::T_body_camera().rotation().inverse();
  EXPECT_LT((R.inverse() * at(0.0, 6.3).rotation()).angle_rad(), 0.005);
}

// Jerks of 0.25 rad to and fro: constant velocity predicts 250 px wrong, the gyro does not.
TEST_F(TrackerTest, GyroHelpsThroughJerks) {
  start();
  const SO3 R_body_camera = TunnelWorld::T_body_camera().rotation();
  SE3 T_last;
  for (int i = 0; i < 20; ++i) {
    const SE3 T = at(0.2 * i, i % 2 == 0 ? 0.0 : 0.25);
    const SO3 R_last_body = T_last.rotation().inverse() * T.rotation();
    T_last = T;
    step(T, {}, R_body_camera.inverse() * R_last_body * R_body_camera);
    ASSERT_TRUE(result_.has_pose()) << i;
    ASSERT_LT(error_m(T), 0.05) << i;
  }
  EXPECT_GT(result_.statistics.inliers, 200);
}

// A minute at 10 Hz with noise, of which a single pose has up to 1 cm: no keyframes, no drift.
TEST_F(TrackerTest, StandsStillForAMinute) {
  start();
  Eigen::Vector3d last_second = Eigen::Vector3d::Zero();
  for (int i = 0; i < 600; ++i) {
    step(at(0.0));
    ASSERT_TRUE(result_.has_pose());
    ASSERT_LT(error_m(at(0.0)), 0.02) << i;
    if (i >= 590) last_second += 0.1 * result_.T_odom_camera.translation();
  }
  EXPECT_EQ(keyframes_, 1);
  EXPECT_LT(last_second.norm(), 0.01);
}

// A third of what is seen drives along at 2 m/s.
TEST_F(TrackerTest, MovingThingsDoNotDragThePose) {
  start();
  for (int i = 0; i <= 40; ++i) {
    step(at(0.3 * i));
    ASSERT_TRUE(result_.has_pose()) << i;
    ASSERT_LT(error_m(at(0.3 * i)), 0.05) << i;
    world_.move_some(3, {0.2, 0.05, 0.0});
  }
  EXPECT_GT(result_.statistics.banned_landmarks, 20);
}

// Something that fills the picture drives along for a while: all of each frame agrees with the
// landmarks that the one before founded on it. Slow things are given away later.
TEST_F(TrackerTest, WhatFillsThePictureDoesNotTakeThePoseAlong) {
  struct Passing {
    double speed_mps;
    int frames;
  };
  for (const auto& [speed_mps, frames] : {Passing{3.0, 5}, Passing{6.0, 12}, Passing{12.0, 20}}) {
    world_ = TunnelWorld();
    frame_id_ = 0;
    start();
    for (int i = 0; i < 20; ++i) step(at(0.3 * i));
    const Eigen::Vector3d step_world(0.1 * speed_mps, 0.0, 0.0);
    int i = 20;
    for (; i < 20 + frames; ++i) {
      world_.move_some(1, step_world);
      step(at(0.3 * i));
      EXPECT_FALSE(result_.keyframe) << speed_mps << " m/s, frame " << i;
    }
    EXPECT_GT(result_.statistics.refused_poses, 0) << speed_mps;
    world_.move_some(1, -frames * step_world);
    for (; i < 40 + frames; ++i) {
      step(at(0.3 * i));
      ASSERT_TRUE(result_.has_pose()) << speed_mps << " m/s, frame " << i;
      ASSERT_LT(error_m(at(0.3 * i)), 0.05) << speed_mps << " m/s, frame " << i;
    }
  }
}

TEST_F(TrackerTest, CorrectionsMoveTheMapNotOdometry) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.3 * i));
  const SE3 T_odom_before = result_.T_odom_camera;
  const SE3 T_map_before = result_.T_map_camera;
  const SE3 T_new_old(SO3::exp({0.0, 0.0, 0.1}), {2.0, -1.0, 0.5});
  tracker_->update_map(corrected_map(T_new_old));
  step(at(6.3));  // the founded map that step sends is of an old epoch, and ignored
  ASSERT_TRUE(result_.has_pose());
  EXPECT_EQ(result_.map_epoch, 1U);
  const SE3 T_step_map = (T_new_old * T_map_before).inverse() * result_.T_map_camera;
  const SE3 T_step_odom = T_odom_before.inverse() * result_.T_odom_camera;
  EXPECT_LT(geometry::local(T_step_map, T_step_odom).norm(), 1e-9);
  EXPECT_NEAR(T_step_odom.translation().z(), 0.3, 0.03);
}

// Mapping is away: what tracking founds must do. Turns of 17 and 40 degrees a second, and a drive.
// A single pose has up to 1 cm (see StandsStillForAMinute), and so has each keyframe against the
// one before: 15 in a turn are 3.9 cm, of which three times as much is allowed.
TEST_F(TrackerTest, GoesOnWithoutMapping) {
  for (const double step_rad : {0.03, 0.07}) {
    world_ = TunnelWorld();
    start();
    for (int i = 0; step_rad * i <= 2.0 * M_PI; ++i) {
      step_without_mapping(at(0.0, step_rad * i));
      ASSERT_EQ(result_.state, TrackingState::kTracking) << step_rad * i << " rad";
      ASSERT_LT(error_m(at(0.0)), 0.12) << step_rad * i << " rad";
    }
  }
  world_ = TunnelWorld();
  start();
  for (int i = 0; i <= 140; ++i) {
    step_without_mapping(at(0.5 * i));
    ASSERT_EQ(result_.state, TrackingState::kTracking) << 0.5 * i << " m";
  }
  EXPECT_LT(error_m(at(70.0)), 0.35) << "0.5 % of the way";
}

TEST_F(TrackerTest, GoesOnWithoutMappingWhileKeyframesAreThinnedOut) {
  start();
  int gone = 0;
  for (int i = 0; i <= 140; ++i) {
    gone += tracker_->thin_out(6) ? 1 : 0;
    step_without_mapping(at(0.5 * i));
    ASSERT_EQ(result_.state, TrackingState::kTracking) << 0.5 * i << " m";
    ASSERT_LE(tracker_->map().pending_count(), 6U);
  }
  EXPECT_GT(gone, 5);
  EXPECT_LT(error_m(at(70.0)), 0.35) << "0.5 % of the way, as with all of them";
}

// Where the camera comes back to, the pose refers to an old keyframe.
TEST_F(TrackerTest, ThePoseStaysWhenItsKeyframeGoes) {
  start();
  for (int i = 0; i <= 60; ++i) step_without_mapping(at(0.5 * i));
  int i = 60;
  while (i > 0 && result_.reference_keyframe_id != 2) step_without_mapping(at(0.5 * --i));
  ASSERT_EQ(tracker_->thin_out(4), 2U);
  step_without_mapping(at(0.5 * i));
  ASSERT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_LT(error_m(at(0.5 * i)), 0.3) << "0.5 % of the way";
}

TEST_F(TrackerTest, LocalisationOnlyMakesNoKeyframes) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  const auto map = map_->local_map(0);
  TrackerConfig config;
  config.localisation_only = true;
  start(config);
  EXPECT_EQ(tracker_->state(), TrackingState::kLost);
  step(at(1.0));
  ASSERT_TRUE(result_.relocalisation_request);
  tracker_->relocalise({frame_id_, 0, 1, at(1.0) * TunnelWorld::T_body_camera()});
  tracker_->update_map(map);
  keyframes_ = 0;
  for (int i = 2; i <= 20; ++i) {
    auto frame = world_.see(at(0.5 * i) * TunnelWorld::T_body_camera(), ++frame_id_, now_ns_);
    now_ns_ += kFrame_ns;
    result_ = tracker_->track(std::move(frame));
    ASSERT_EQ(result_.state, TrackingState::kLocalisationOnly) << i;
    EXPECT_FALSE(result_.keyframe);
  }
  EXPECT_LT(error_m(at(10.0)), 0.05);
}

// Each depth is an outlier once in three frames, as a real camera's are at edges: no landmark
// deserves to be given up for that, and there are no new ones in a map that stays as it is.
TEST_F(TrackerTest, LocalisationOnlyDoesNotUseUpTheMap) {
  start();
  for (int i = 0; i <= 3; ++i) step(at(0.5 * i));
  const auto map = map_->local_map(0);
  TrackerConfig config;
  config.localisation_only = true;
  start(config);
  step(at(1.0));
  tracker_->relocalise({frame_id_, 0, 1, at(1.0) * TunnelWorld::T_body_camera()});
  tracker_->update_map(map);
  std::mt19937 random(5);
  for (int i = 0; i < 300; ++i) {
    auto frame = world_.see(at(1.0) * TunnelWorld::T_body_camera(), ++frame_id_, now_ns_);
    for (auto& depth_m : frame.features.depth_m) depth_m += random() % 3 == 0 ? 1.0F : 0.0F;
    now_ns_ += kFrame_ns;
    result_ = tracker_->track(std::move(frame));
    ASSERT_EQ(result_.state, TrackingState::kLocalisationOnly) << i;
    ASSERT_LT(error_m(at(1.0)), 0.05) << i;
    ASSERT_GT(result_.statistics.inliers, 100) << i;
  }
}

TEST_F(TrackerTest, NewKeyframesGetIdsThatTheMapDoesNotHave) {
  start();
  for (int i = 0; i <= 10; ++i) step(at(0.5 * i));
  LocalMap map = map_->local_map(frame_id_ + 1);
  map.next_keyframe_id = 1000;
  tracker_->update_map(map);
  for (int i = 11; i <= 40; ++i) {
    ++frame_id_;
    auto frame = world_.see(at(0.5 * i) * TunnelWorld::T_body_camera(), frame_id_, now_ns_);
    now_ns_ += kFrame_ns;
    const auto result = tracker_->track(std::move(frame));
    if (!result.keyframe) continue;
    EXPECT_EQ(result.keyframe->id, 1000U);
    return;
  }
  FAIL() << "no keyframe";
}

TEST(TrackerConfigTest, RefusesNonsense) {
  TrackerConfig config;
  config.depth_model = "stereo";
  config.min_inliers = 3;
  try {
    const Tracker tracker(config, TunnelWorld().camera(), SE3());
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 2U);
  }
}

}  // namespace
}  // namespace camvox::tracking
