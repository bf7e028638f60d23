#include "camvox/tracking_component/tracking_component.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>
#include <random>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;
using testing::HasSubstr;

constexpr int kWidth = 320;
constexpr int kHeight = 240;
constexpr int kMargin = 80;
constexpr double kFocal_px = 250.0;
constexpr float kWall_m = 5.0F;
constexpr std::int64_t kFrame_ns = 100'000'000;

/// A camera that moves along a wall covered with a random pattern: a shift of the image by one
/// pixel is a way of wall / focal length.
class TrackingComponentTest : public testing::Test {
 protected:
  TrackingComponentTest() {
    fake_.set_parameter("camera.width_px", std::int64_t{kWidth});
    fake_.set_parameter("camera.height_px", std::int64_t{kHeight});
    fake_.set_parameter("camera.fx_px", kFocal_px);
    fake_.set_parameter("camera.fy_px", kFocal_px);
    fake_.set_parameter("camera.cx_px", 159.5);
    fake_.set_parameter("camera.cy_px", 119.5);
    fake_.set_parameter("camera.distortion", std::vector<double>{});
    fake_.set_parameter("frame.extractor.features", std::int64_t{500});
    fake_.set_parameter("use_imu", false);
    std::mt19937 random(3);
    wall_.resize(static_cast<std::size_t>((kWidth + 2 * kMargin) * kHeight));
    for (int v = 0; v < kHeight; v += 4) {
      for (int u = 0; u < kWidth + 2 * kMargin; u += 4) fill_tile(u, v, random());
    }
  }
  void fill_tile(int u0, int v0, std::uint_fast32_t grey) {
    for (int v = v0; v < v0 + 4; ++v) {
      for (int u = u0; u < u0 + 4; ++u) {
        wall_[static_cast<std::size_t>(v * (kWidth + 2 * kMargin) + u)] =
            static_cast<std::uint8_t>(grey);
      }
    }
  }
  void start() { component_ = std::make_unique<TrackingComponent>(fake_); }

  void fill_header(msg::MessageHeader& header, std::uint64_t frame_id) {
    header.frame_id(frame_id);
    header.stamp_ns(static_cast<std::int64_t>(frame_id) * kFrame_ns + stamps_begin_ns_);
  }
  void send_image(std::uint64_t frame_id, int shift_px, bool black = false) {
    fake_.send<msg::FrameImage>("frame_image", [&](msg::FrameImage& image) {
      fill_header(image.header(), frame_id);
      image.width_px(kWidth);
      image.height_px(kHeight);
      image.row_step_bytes(kWidth);
      image.encoding(msg::ENCODING_MONO8);
      image.data_count(kWidth * kHeight);
      for (int v = 0; v < kHeight; ++v) {
        for (int u = 0; u < kWidth; ++u) {
          const int place = v * (kWidth + 2 * kMargin) + u + kMargin + shift_px;
          image.data()[static_cast<std::size_t>(v * kWidth + u)] =
              black ? std::uint8_t{0} : wall_[static_cast<std::size_t>(place)];
        }
      }
    });
  }
  void send_depth(std::uint64_t frame_id, bool empty = false) {
    fake_.send<msg::DepthImage>("depth_image", [&](msg::DepthImage& depth) {
      fill_header(depth.header(), frame_id);
      depth.width_px(kWidth);
      depth.height_px(kHeight);
      const std::uint32_t count = empty ? 0 : kWidth * kHeight;
      depth.depth_m_count(count);
      depth.sigma_m_count(count);
      for (std::uint32_t i = 0; i < count; ++i) {
        depth.depth_m()[i] = kWall_m;
        depth.sigma_m()[i] = 0.02F;
      }
    });
  }
  void send(std::uint64_t frame_id, int shift_px, bool black = false) {
    send_image(frame_id, shift_px, black);
    send_depth(frame_id);
  }
  /// What mapping answers: nothing new, so tracking keeps its own keyframes.
  void send_local_map(std::uint64_t frame_id, std::uint64_t next_keyframe_id = 1000) {
    fake_.send<msg::LocalMap>("local_map", [&](msg::LocalMap& map) {
      fill_header(map.header(), frame_id);
      map.next_keyframe_id(next_keyframe_id);
    });
  }
  [[nodiscard]] auto poses() { return fake_.published<msg::FramePose>("frame_pose"); }
  /// Of the body in the map, in the body's axes of the start: y is to the left.
  [[nodiscard]] Eigen::Vector3d p_map_body(const msg::FramePose& pose) const {
    const auto rig = sensors::make_rig_calibration();
    return (conversion::to_se3(pose.T_map_camera()) * rig.T_body_camera.inverse()).translation();
  }

  FakeContext fake_{"tracking"};
  std::int64_t stamps_begin_ns_ = 0;
  std::vector<std::uint8_t> wall_;
  std::unique_ptr<TrackingComponent> component_;
};

TEST_F(TrackingComponentTest, StartsAMapAndFollows) {
  start();
  send(1, 0);
  ASSERT_EQ(poses().size(), 1U);
  const auto& first = *poses()[0];
  EXPECT_EQ(first.state(), msg::TRACKING_OK);
  EXPECT_EQ(first.reference_keyframe_id(), 1U);
  EXPECT_GT(first.features_with_depth(), 100U);
  EXPECT_LT(p_map_body(first).norm(), 1e-9);
  const auto keyframes = fake_.published<msg::Keyframe>("keyframe");
  ASSERT_EQ(keyframes.size(), 1U);
  EXPECT_EQ(keyframes[0]->id(), 1U);
  EXPECT_EQ(keyframes[0]->header().frame_id(), 1U);
  EXPECT_GT(keyframes[0]->features_count(), 100U);
  EXPECT_EQ(keyframes[0]->landmark_ids()[0], tracking::landmark_id(1, 0));

  for (std::uint64_t k = 2; k <= 6; ++k) send(k, 4 * static_cast<int>(k - 1));
  ASSERT_EQ(poses().size(), 6U);
  const auto& last = *poses()[5];
  EXPECT_EQ(last.state(), msg::TRACKING_OK);
  // The camera moved 20 px * 5 m / 250 px = 0.4 m to the right; a tenth of a pixel is 2 mm.
  EXPECT_LT((p_map_body(last) - Eigen::Vector3d(0.0, -0.4, 0.0)).norm(), 0.01);
  EXPECT_NEAR(last.velocity_camera()[0], 0.8, 0.1);
  EXPECT_EQ(fake_.published<msg::Progress>("progress").size(), 6U);
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kOk);
  fake_.verify_nothing_left();
}

TEST_F(TrackingComponentTest, TellsRosWhereTheRobotIs) {
  start();
  fake_.set_subscriber_count("path", 1);
  for (std::uint64_t k = 1; k <= 4; ++k) send(k, 10 * static_cast<int>(k - 1));
  const auto odometry = fake_.published<nav_msgs::msg::Odometry>("odometry");
  ASSERT_EQ(odometry.size(), 4U);
  EXPECT_EQ(odometry[3]->header().frame_id(), "odom");
  EXPECT_EQ(odometry[3]->child_frame_id(), "base_link");
  EXPECT_NEAR(odometry[3]->pose().pose().position().y(), -0.6, 0.015);
  EXPECT_GT(odometry[3]->pose().covariance()[0], 0.0);
  EXPECT_NEAR(odometry[3]->twist().twist().linear().y(), -2.0, 0.2);
  const auto transforms = fake_.published<tf2_msgs::msg::TFMessage>("tf");
  ASSERT_EQ(transforms.size(), 4U);
  ASSERT_EQ(transforms[3]->transforms().size(), 2U);
  EXPECT_EQ(transforms[3]->transforms()[0].header().frame_id(), "map");
  EXPECT_EQ(transforms[3]->transforms()[0].child_frame_id(), "odom");
  EXPECT_NEAR(transforms[3]->transforms()[0].transform().translation().y(), 0.0, 1e-6);
  EXPECT_EQ(transforms[3]->transforms()[1].child_frame_id(), "base_link");
  EXPECT_FALSE(fake_.published<nav_msgs::msg::Path>("path").empty());
}

TEST_F(TrackingComponentTest, LockstepWaitsForTheMapOfTheFrameBefore) {
  fake_.set_parameter("lockstep", true);
  start();
  send_depth(1);
  send_image(1, 0);
  EXPECT_EQ(poses().size(), 1U);
  send(2, 4);
  EXPECT_EQ(poses().size(), 1U);
  send_local_map(1);
  EXPECT_EQ(poses().size(), 2U);
  send_local_map(2);
  send(3, 8);
  EXPECT_EQ(poses().size(), 3U);
}

TEST_F(TrackingComponentTest, LiveTheNewestFrameCounts) {
  start();
  send(1, 0);
  send_image(2, 4);
  send_image(3, 8);
  send_depth(3);
  ASSERT_GE(poses().size(), 2U);
  EXPECT_EQ(poses().back()->header().frame_id(), 3U);
  send_depth(2);  // too late
  EXPECT_EQ(poses().back()->header().frame_id(), 3U);
  send_image(2, 4);
  send(4, 12);
  EXPECT_EQ(poses().back()->header().frame_id(), 4U);
  EXPECT_EQ(fake_.diagnostics().status().values["dropped frames"], "1") << "the late image";
}

// Sync was started anew: its ids begin at 1 again, but time has gone on.
TEST_F(TrackingComponentTest, FollowsFramesThatCountFromOneAgain) {
  start();
  for (std::uint64_t k = 1; k <= 4; ++k) send(k, 4 * static_cast<int>(k - 1));
  send_local_map(4);
  stamps_begin_ns_ = 4 * kFrame_ns;
  for (std::uint64_t k = 1; k <= 3; ++k) {
    send_image(k, 4 * static_cast<int>(k + 3));
    send_depth(k);
  }
  ASSERT_EQ(poses().size(), 7U);
  EXPECT_EQ(poses()[6]->header().frame_id(), 3U);
  EXPECT_EQ(poses()[6]->state(), msg::TRACKING_OK);
  // 24 px * 5 m / 250 px
  EXPECT_LT((p_map_body(*poses()[6]) - Eigen::Vector3d(0.0, -0.48, 0.0)).norm(), 0.01);
  // Maps count by the new ids as well: this one is taken, and shows no landmark.
  fake_.send<msg::LocalMap>("local_map", [&](msg::LocalMap& map) {
    fill_header(map.header(), 3);
    map.keyframe_ids()[0] = 1;
    map.keyframe_poses()[0] = conversion::to_array(geometry::SE3());
    map.keyframe_ids_count(1);
    map.keyframe_poses_count(1);
    map.next_keyframe_id(1000);
  });
  send(4, 28);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_LOST);
}

TEST_F(TrackingComponentTest, WhatMappingLacksIsSentAgain) {
  start();
  send(1, 0);
  send_local_map(1, 2);
  EXPECT_TRUE(fake_.published<msg::Keyframe>("resent_keyframe").empty());
  send(2, 4);
  send_local_map(2, 1);  // of a mapping that was restarted
  const auto resent = fake_.published<msg::Keyframe>("resent_keyframe");
  ASSERT_EQ(resent.size(), 1U);
  EXPECT_EQ(resent[0]->id(), 1U);
  EXPECT_EQ(resent[0]->features_count(),
            fake_.published<msg::Keyframe>("keyframe")[0]->features_count());
}

// Back and forth along the wall, with all keyframes that may be.
TEST_F(TrackingComponentTest, AMappingThatWasAwayForLongGetsACoarserMapInOnePiece) {
  fake_.set_parameter("keyframes_kept", std::int64_t{10});
  fake_.set_parameter("tracker.keyframe.min_inlier_ratio", 1.0);
  fake_.set_parameter("tracker.keyframe.first_inlier_ratio", 1.0);
  fake_.set_parameter("tracker.keyframe.max_interval_s", 0.05);
  fake_.set_parameter("tracker.keyframe.max_pending", std::int64_t{1000});
  start();
  for (std::uint64_t k = 1; k <= 120; ++k) {
    send(k, static_cast<int>(60.0 * std::sin(0.1 * static_cast<double>(k))));
    ASSERT_EQ(poses().back()->state(), msg::TRACKING_OK) << k;
  }
  const auto made = fake_.published<msg::Keyframe>("keyframe");
  ASSERT_GT(made.size(), 20U);
  EXPECT_GT(std::stoi(fake_.diagnostics().status().values["keyframes thinned out"]), 10);
  EXPECT_EQ(fake_.log_entries().size(), 1U) << "said once";
  EXPECT_THAT(fake_.log_entries().front().text, HasSubstr("10 keyframes"));

  send_local_map(120, 1);
  send_local_map(120, fake_.published<msg::Keyframe>("resent_keyframe").back()->id() + 1);
  std::map<std::uint64_t, geometry::SE3> there;
  for (const auto& keyframe : fake_.published<msg::Keyframe>("resent_keyframe")) {
    const auto T_map_camera = conversion::to_se3(keyframe->T_map_camera());
    const auto parent = there.find(keyframe->parent_keyframe_id());
    ASSERT_TRUE(there.empty() || parent != there.end()) << keyframe->id();
    if (!there.empty()) {
      const auto T_parent_camera = conversion::to_se3(keyframe->T_parent_camera());
      EXPECT_LT(geometry::local(T_map_camera, parent->second * T_parent_camera).norm(), 1e-9);
    }
    there[keyframe->id()] = T_map_camera;
  }
  EXPECT_GE(there.size(), 9U);
  EXPECT_LE(there.size(), 10U);
  EXPECT_EQ(there.begin()->first, 1U);
  EXPECT_EQ(there.rbegin()->first, made.back()->id());
}

// Mapping has outlived the tracking before: keyframe 1 is another one there.
TEST_F(TrackingComponentTest, WhatBelongsToNoMapIsNotSentAgain) {
  start();
  send(1, 0);
  const auto send_older_map = [this](std::uint64_t frame_id, std::uint64_t next_keyframe_id) {
    fake_.send<msg::LocalMap>("local_map", [&](msg::LocalMap& map) {
      fill_header(map.header(), frame_id);
      map.keyframe_ids()[0] = 7;
      map.keyframe_poses()[0] = conversion::to_array(geometry::SE3());
      map.keyframe_ids_count(1);
      map.keyframe_poses_count(1);
      map.next_keyframe_id(next_keyframe_id);
    });
  };
  send_older_map(1, 8);
  send(2, 4);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_LOST);
  EXPECT_EQ(fake_.published<msg::Keyframe>("relocalisation_request").size(), 1U);
  send_older_map(2, 1);  // of a mapping that was restarted
  EXPECT_TRUE(fake_.published<msg::Keyframe>("resent_keyframe").empty());
}

TEST_F(TrackingComponentTest, WithImuAFrameWaitsForItsCloud) {
  fake_.set_parameter("use_imu", true);
  start();
  send(1, 0);
  EXPECT_TRUE(poses().empty());
  fake_.send<msg::Cloud>("cloud", [&](msg::Cloud& cloud) { fill_header(cloud.header(), 1); });
  EXPECT_EQ(poses().size(), 1U);
}

// A gyro that says "no turn" agrees with a camera that moves sideways.
TEST_F(TrackingComponentTest, FollowsWithAGyro) {
  fake_.set_parameter("use_imu", true);
  start();
  for (std::uint64_t k = 1; k <= 3; ++k) {
    fake_.send<msg::Cloud>("cloud", [&](msg::Cloud& cloud) {
      fill_header(cloud.header(), k);
      cloud.rotation_imu() = {0.0, 0.0, 0.0, 1.0};
    });
    send(k, 2 * static_cast<int>(k - 1));
  }
  ASSERT_EQ(poses().size(), 3U);
  EXPECT_EQ(poses()[2]->state(), msg::TRACKING_OK);
  EXPECT_LT((p_map_body(*poses()[2]) - Eigen::Vector3d(0.0, -0.08, 0.0)).norm(), 0.01);
}

// The images stand still and the gyro, believed above all, says 4 mrad (a pixel) about the IMU's z:
// what axis of the camera that is, is up to the extrinsics. Turned by 90 degrees about the camera's
// x, its -y becomes -z.
TEST_F(TrackingComponentTest, TurnsTheGyroByTheExtrinsicsInForce) {
  constexpr double kTurn_rad = 0.004;
  const auto camera_turn = [&](std::uint64_t frame_id) {
    fake_.send<msg::Cloud>("cloud", [&](msg::Cloud& cloud) {
      fill_header(cloud.header(), frame_id);
      cloud.rotation_imu() = {0.0, 0.0, std::sin(0.5 * kTurn_rad), std::cos(0.5 * kTurn_rad)};
    });
    send(frame_id, 0);
    const auto& sent = poses();
    const auto T_before = conversion::to_se3(sent.at(frame_id - 2)->T_map_camera());
    return (T_before.inverse() * conversion::to_se3(sent.back()->T_map_camera())).rotation().log();
  };
  const auto send_extrinsics = [&](std::uint64_t version, std::uint8_t applied) {
    const auto turned = geometry::SO3::exp({0.5 * std::numbers::pi, 0.0, 0.0});
    const auto T_camera_lidar = sensors::make_rig_calibration().T_camera_lidar();
    msg::Extrinsics extrinsics;
    extrinsics.version(version);
    extrinsics.applied(applied);
    extrinsics.T_camera_lidar(
        conversion::to_array(geometry::SE3(turned, {0.0, 0.0, 0.0}) * T_camera_lidar));
    fake_.send("extrinsics", extrinsics);
  };
  fake_.set_parameter("use_imu", true);
  fake_.set_parameter("tracker.gyro_sigma_deg", 1e-4);
  start();
  fake_.send<msg::Cloud>("cloud", [&](msg::Cloud& cloud) { fill_header(cloud.header(), 1); });
  send(1, 0);
  const Eigen::Vector3d about_y(0.0, -kTurn_rad, 0.0);
  EXPECT_LT((camera_turn(2) - about_y).norm(), 0.1 * kTurn_rad);
  send_extrinsics(1, 0);
  EXPECT_LT((camera_turn(3) - about_y).norm(), 0.1 * kTurn_rad) << "only proposed";
  send_extrinsics(1, 1);
  EXPECT_LT((camera_turn(4) - Eigen::Vector3d(0.0, 0.0, -kTurn_rad)).norm(), 0.1 * kTurn_rad);
}

TEST_F(TrackingComponentTest, BlackImageIsLostAndAsksNobodyUntilItSeesSomething) {
  start();
  for (std::uint64_t k = 1; k <= 3; ++k) send(k, 0);
  for (std::uint64_t k = 4; k <= 6; ++k) send(k, 0, true);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_LOST);
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kError);
  EXPECT_EQ(fake_.published<nav_msgs::msg::Odometry>("odometry").size(), 3U);
  EXPECT_TRUE(fake_.published<msg::Keyframe>("relocalisation_request").empty());
  send(7, 3);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_OK);
}

/// With another wall in view the place is not known.
TEST_F(TrackingComponentTest, WithALoadedMapItLooksForItsPlaceFirst) {
  fake_.set_parameter("lockstep", true);
  fake_.set_parameter("load_map", std::string("map.mcap"));
  fake_.set_parameter("localisation_only", true);
  start();
  send(1, 0);
  EXPECT_TRUE(poses().empty()) << "the map has not come";
  fake_.send<msg::LocalMap>("local_map", [](msg::LocalMap& map) {
    map.keyframe_ids()[0] = 5;
    map.keyframe_poses()[0] = conversion::to_array(geometry::SE3());
    map.keyframe_ids_count(1);
    map.keyframe_poses_count(1);
    map.next_keyframe_id(6);
  });
  ASSERT_EQ(poses().size(), 1U);
  EXPECT_EQ(poses()[0]->state(), msg::TRACKING_LOST);
  EXPECT_TRUE(fake_.published<msg::Keyframe>("keyframe").empty());
  EXPECT_EQ(fake_.published<msg::Keyframe>("relocalisation_request").size(), 1U);
}

TEST_F(TrackingComponentTest, LockstepWaitsForTheAnswerToItsRequest) {
  fake_.set_parameter("lockstep", true);
  fake_.set_parameter("wait_for_map", false);
  start();
  fake_.set_subscriber_count("relocalisation_request", 1);
  send(1, 0);
  std::mt19937 random(77);
  for (auto& pixel : wall_) pixel = static_cast<std::uint8_t>(random());
  send(2, 0);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_LOST);
  const auto requests = fake_.published<msg::Keyframe>("relocalisation_request");
  ASSERT_EQ(requests.size(), 1U);
  EXPECT_EQ(requests[0]->header().frame_id(), 2U);
  send(3, 0);
  EXPECT_EQ(poses().size(), 2U);
  msg::RelocalisationAnswer answer;
  fill_header(answer.header(), 2);
  fake_.send("relocalisation_answer", answer);
  EXPECT_EQ(poses().size(), 3U);
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_LOST);
}

TEST_F(TrackingComponentTest, TracksOnWithoutDepth) {
  start();
  send(1, 0);
  for (std::uint64_t k = 2; k <= 8; ++k) {
    send_image(k, 3 * static_cast<int>(k - 1));
    send_depth(k, true);
  }
  EXPECT_EQ(poses().back()->state(), msg::TRACKING_OK);
  EXPECT_EQ(poses().back()->features_with_depth(), 0U);
  EXPECT_NEAR(p_map_body(*poses().back()).y(), -0.42, 0.02);
}

TEST_F(TrackingComponentTest, WrongIntrinsicsAreRefused) {
  fake_.set_parameter("camera.fx_px", -3.0);
  try {
    start();
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("fx_px"));
  }
}

TEST_F(TrackingComponentTest, MalformedMapsAreAnError) {
  start();
  EXPECT_ANY_THROW(fake_.send<msg::LocalMap>("local_map", [&](msg::LocalMap& map) {
    fill_header(map.header(), 1);
    map.landmark_ids_count(5);
    map.keyframe_ids_count(1);
  }));
}

}  // namespace
}  // namespace camvox
