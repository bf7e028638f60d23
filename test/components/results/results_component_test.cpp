#include "camvox/results/results_component.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/trajectory/trajectory_file.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FramePose;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::MapUpdate;
using camvox_interfaces::msg::Progress;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;

class ResultsTest : public testing::Test {
 protected:
  ResultsTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    fake_.set_parameter("output_dir", folder_.string());
    // The camera looks along the body's x axis, 1 m above it.
    fake_.set_parameter("rig.T_body_camera.translation_m", std::vector<double>{0.0, 0.0, 1.0});
  }

  /// The body at `x` m: T_map_camera = T_map_body * T_body_camera.
  [[nodiscard]] static geometry::SE3 camera_at(double x_m) {
    return geometry::SE3(geometry::SO3(), {x_m, 0.0, 0.0}) *
           geometry::SE3(geometry::SO3(Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5)), {0.0, 0.0, 1.0});
  }

  void send_keyframe(std::uint64_t id, std::int64_t stamp_ns, double x_m) {
    fake_.send<Keyframe>("keyframe", [&](Keyframe& keyframe) {
      keyframe.id(id);
      keyframe.header().stamp_ns(stamp_ns);
      keyframe.T_map_camera(conversion::to_array(camera_at(x_m)));
    });
  }

  void send_pose(std::uint64_t frame,
                 std::uint64_t keyframe,
                 double keyframe_x_m,
                 double x_m,
                 std::uint8_t state = camvox_interfaces::msg::TRACKING_OK) {
    FramePose pose;
    pose.header().frame_id(frame);
    pose.header().stamp_ns(kStart_ns + static_cast<std::int64_t>(frame) * 100'000'000);
    pose.reference_keyframe_id(keyframe);
    pose.T_map_camera(conversion::to_array(camera_at(x_m)));
    pose.T_keyframe_camera(
        conversion::to_array(camera_at(keyframe_x_m).inverse() * camera_at(x_m)));
    pose.state(state);
    pose.inliers(123);
    fake_.send("frame_pose", pose);
  }

  [[nodiscard]] std::string text(const char* name) const {
    std::ifstream stream(folder_ / name);
    return {std::istreambuf_iterator<char>(stream), {}};
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("results_" + std::to_string(getpid()));
  FakeContext fake_;
};

TEST_F(ResultsTest, TrajectoryFollowsTheMapAndOdometryDoesNot) {
  ResultsComponent results(fake_);
  send_keyframe(1, kStart_ns + 100'000'000, 0.0);
  send_pose(1, 1, 0.0, 0.0);
  send_pose(2, 1, 0.0, 2.0);
  fake_.send<MapUpdate>("map_update", [](MapUpdate& update) {
    update.keyframe_ids()[0] = 1;
    update.keyframe_poses()[0] = conversion::to_array(camera_at(5.0));
    update.keyframe_ids_count(1);
    update.keyframe_poses_count(1);
  });
  send_pose(3, 1, 0.0, 0.0, camvox_interfaces::msg::TRACKING_LOST);
  results.stop();

  const auto corrected = trajectory::read_tum(folder_ / "trajectory.tum");
  ASSERT_TRUE(corrected.ok()) << corrected.status().message();
  ASSERT_EQ(corrected->size(), 2U) << "a lost frame has no pose";
  const Eigen::Vector3d p_map = (*corrected)[1].T_world_body.translation();
  EXPECT_LT((p_map - Eigen::Vector3d(7.0, 0.0, 0.0)).norm(), 1e-8) << "of the body, not the camera";
  const auto odometry = trajectory::read_tum(folder_ / "odometry.tum");
  EXPECT_NEAR((*odometry)[1].T_world_body.translation().x(), 2.0, 1e-8);
  const auto keyframes = trajectory::read_tum(folder_ / "keyframes.tum");
  ASSERT_EQ(keyframes->size(), 1U);
  EXPECT_EQ((*keyframes)[0].stamp_ns, kStart_ns + 100'000'000);
  EXPECT_THAT(text("frames.csv"), HasSubstr("\n3,1700000000300000000,lost,1,0,0,0,0,123,"));
}

TEST_F(ResultsTest, FramesMayReferToALoadedMap) {
  ResultsComponent results(fake_);
  fake_.send<Keyframe>("map_keyframe", [](Keyframe& keyframe) {
    keyframe.id(33);
    keyframe.T_map_camera(conversion::to_array(camera_at(4.0)));
  });
  send_pose(1, 33, 0.0, 1.0);
  results.stop();
  const auto frames = trajectory::read_tum(folder_ / "trajectory.tum");
  ASSERT_TRUE(frames.ok() && frames->size() == 1U);
  EXPECT_NEAR((*frames)[0].T_world_body.translation().x(), 5.0, 1e-8);
}

TEST_F(ResultsTest, TimingIsTheStatisticsOfWhatComponentsReported) {
  ResultsComponent results(fake_);
  for (int i = 1; i <= 100; ++i) {
    Progress progress;
    progress.processing_time_s(1e-3 * i);
    std::strcpy(progress.component_name().data(), "deskew");
    fake_.send("progress", progress);
  }
  results.stop();
  EXPECT_THAT(text("timing.csv"), HasSubstr("\ndeskew,100,51.000,50.500,95.000,99.000,100.000\n"));
}

// Sync reports each image, tracking takes the newest of them.
TEST_F(ResultsTest, SaysHowManyFramesGotNoPoseAtAll) {
  ResultsComponent results(fake_);
  for (const std::uint64_t frame : {1, 2, 0, 3, 4, 1, 4}) {  // 0: made no frame
    Progress progress;
    progress.header().frame_id(frame);
    fake_.send("progress", progress);
  }
  send_keyframe(1, kStart_ns, 0.0);
  send_pose(1, 1, 0.0, 0.0);
  send_pose(4, 1, 0.0, 0.0, camvox_interfaces::msg::TRACKING_LOST);
  results.stop();
  EXPECT_THAT(fake_.log_entries().back().text,
              HasSubstr("1 of 2 frames tracked, 2 more were passed over; results"));
}

TEST_F(ResultsTest, WithAPoseOfEachNoneWasOvertaken) {
  ResultsComponent results(fake_);
  fake_.send("progress", Progress());
  send_keyframe(1, kStart_ns, 0.0);
  send_pose(1, 1, 0.0, 0.0);
  results.stop();
  EXPECT_THAT(fake_.log_entries().back().text, HasSubstr("1 of 1 frames tracked; results"));
}

TEST_F(ResultsTest, AFolderThatIsGoneIsAnErrorInTheLog) {
  ResultsComponent results(fake_);
  std::filesystem::remove_all(folder_);
  EXPECT_THROW(results.stop(), std::runtime_error);
  ASSERT_FALSE(fake_.log_entries().empty());
  EXPECT_THAT(fake_.log_entries()[0].text, HasSubstr("trajectory.tum: cannot be written"));
}

TEST_F(ResultsTest, ARunWithoutFramesLeavesEarlierResults) {
  std::ofstream(folder_ / "trajectory.tum") << "1.0 1 2 3 0 0 0 1\n";
  ResultsComponent results(fake_);
  results.stop();
  EXPECT_EQ(text("trajectory.tum"), "1.0 1 2 3 0 0 0 1\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "frames.csv"));
  ASSERT_FALSE(fake_.log_entries().empty());
  EXPECT_THAT(fake_.log_entries()[0].text, HasSubstr("the earlier results in"));
}

TEST_F(ResultsTest, FailsWithoutAPoseIfToldTo) {
  fake_.set_parameter("fail_without_poses", true);
  ResultsComponent none(fake_);
  EXPECT_THAT([&] { none.stop(); },
              ThrowsMessage<std::runtime_error>(HasSubstr("no frame was tracked: not one came")));
  FakeContext fake;
  fake.set_parameter("fail_without_poses", true);
  ResultsComponent results(fake);
  FramePose pose;
  pose.T_map_camera(conversion::to_array(camera_at(0.0)));
  pose.T_keyframe_camera(conversion::to_array(geometry::SE3()));
  fake.send("frame_pose", pose);
  EXPECT_THAT([&] { results.stop(); },
              ThrowsMessage<std::runtime_error>(HasSubstr("of 1 frames none had depth")));
  pose.features_with_depth(9);
  fake.send("frame_pose", pose);
  EXPECT_THAT(
      [&] { results.stop(); },
      ThrowsMessage<std::runtime_error>(HasSubstr("of 2 frames 1 had depth, but no place")));
  pose.state(camvox_interfaces::msg::TRACKING_OK);
  fake.send("frame_pose", pose);
  EXPECT_NO_THROW(results.stop());
}

TEST_F(ResultsTest, WritesNothingWithoutAFolder) {
  FakeContext fake;
  ResultsComponent results(fake);
  results.stop();
  EXPECT_TRUE(fake.log_entries().empty());
}

}  // namespace
}  // namespace camvox
