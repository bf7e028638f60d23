#include "camvox/calibration_component/calibration_component.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "simulated_stop.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::Extrinsics;
using camvox_interfaces::msg::FrameImage;
using ::testing::EndsWith;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

const calibration::Scene& corridor() {
  static const calibration::Scene scene = test::look_from({"corridor", 1, 6.0, 0.0, 0.0}, 1);
  return scene;
}

/// The component with a recorded rig that is off by a degree and a half.
class CalibrationComponentTest : public ::testing::Test {
 protected:
  CalibrationComponentTest() {
    const geometry::SE3 T_lidar_camera =
        test::true_T_camera_lidar().inverse() *
        geometry::SE3::exp((geometry::Vector6d() << 0.02, -0.015, 0.01, 0, 0, 0).finished());
    const auto& t = T_lidar_camera.translation();
    const auto& q = T_lidar_camera.rotation().quaternion();
    fake_.set_parameter("rig.T_lidar_camera.translation_m",
                        std::vector<double>{t.x(), t.y(), t.z()});
    fake_.set_parameter("rig.T_lidar_camera.rotation_xyzw",
                        std::vector<double>{q.x(), q.y(), q.z(), q.w()});
    fake_.set_parameter("collect_s", 1.0);
    folder_ = fs::temp_directory_path() / ("camvox_calibration_" + std::to_string(getpid()));
    fs::create_directories(folder_);
    fake_.set_parameter("rig_file", (folder_ / "rig.yaml").string());
    fake_.set_parameter("output_dir", (folder_ / "results").string());
  }
  ~CalibrationComponentTest() override { fs::remove_all(folder_); }

  static std::uint64_t frame_of(std::int64_t stamp_ns) {
    return 1 + static_cast<std::uint64_t>(10 * stamp_ns / kSecond_ns);
  }
  void send_cloud(std::int64_t stamp_ns, bool stationary, bool with_points) {
    fake_.send<Cloud>("cloud", [&](Cloud& cloud) {
      cloud.header().stamp_ns(stamp_ns);
      cloud.header().frame_id(frame_of(stamp_ns));
      cloud.stationary(stationary ? 1 : 0);
      const auto& points = corridor().points_lidar;
      const std::size_t count = with_points ? points.size() : 0;
      for (std::size_t i = 0; i < count; ++i) {
        std::memcpy(cloud.points()[i].data(), points[i].data(), sizeof(float) * 4);
      }
      cloud.points_count(static_cast<std::uint32_t>(count));
    });
  }
  void send_image(std::int64_t stamp_ns) {
    fake_.send<FrameImage>("frame_image", [&](FrameImage& message) {
      const cv::Mat& image = corridor().image;
      message.header().stamp_ns(stamp_ns);
      message.header().frame_id(frame_of(stamp_ns));
      message.width_px(static_cast<std::uint32_t>(image.cols));
      message.height_px(static_cast<std::uint32_t>(image.rows));
      message.row_step_bytes(static_cast<std::uint32_t>(3 * image.cols));
      message.encoding(camvox_interfaces::msg::ENCODING_BGR8);
      const std::size_t bytes = image.total() * 3;
      std::memcpy(message.data().data(), image.data, bytes);
      message.data_count(static_cast<std::uint32_t>(bytes));
    });
  }
  void stand_still(std::int64_t from_ns = 0) {
    send_image(from_ns);
    send_cloud(from_ns, true, true);
    send_cloud(from_ns + kSecond_ns, true, false);  // the two of a frame come in any order
    send_image(from_ns + kSecond_ns);
  }
  void move(std::int64_t stamp_ns) {
    send_cloud(stamp_ns, false, false);
    send_image(stamp_ns);
  }
  /// Calibrations that ran at this standstill. With a camera that does not fit the image each says
  /// so at once: when they run does not depend on how they end.
  std::size_t runs_at(std::int64_t stamp_ns, bool expected) {
    stand_still(stamp_ns);
    return fake_.run_posted(expected ? std::chrono::seconds(60) : std::chrono::seconds(0));
  }

  FakeContext fake_{"calibration"};
  fs::path folder_;
};

TEST_F(CalibrationComponentTest, AppliesABetterResultAtStandstill) {
  CalibrationComponent component(fake_);
  stand_still();
  ASSERT_EQ(fake_.run_posted(std::chrono::minutes(2)), 1U);
  const auto published = fake_.published<Extrinsics>("extrinsics");
  ASSERT_EQ(published.size(), 1U);
  EXPECT_EQ(published[0]->applied(), 1);
  EXPECT_EQ(published[0]->version(), 1U);
  EXPECT_LT(published[0]->cost_after(), published[0]->cost_before());
  const auto T = conversion::to_se3(published[0]->T_camera_lidar());
  const double error_rad =
      (T.rotation().inverse() * test::true_T_camera_lidar().rotation()).angle_rad();
  EXPECT_LT(error_rad * 180.0 / std::numbers::pi, 0.1);

  const std::string text = text_of(folder_ / "rig.yaml");
  EXPECT_THAT(text, HasSubstr("camera:\n"));
  EXPECT_THAT(text, HasSubstr("rig:\n"));
  EXPECT_THAT(text, HasSubstr("  T_lidar_camera:\n    rotation_xyzw: ["));
  const auto results = folder_ / "results";
  const auto* remembered = std::any_cast<Extrinsics>(fake_.restart_memory());
  ASSERT_NE(remembered, nullptr);
  EXPECT_EQ(*remembered, *published[0]);
  EXPECT_TRUE(fs::exists(results / "calibration_before.png"));
  EXPECT_TRUE(fs::exists(results / "calibration_after.png"));
  const std::string verdict = text_of(results / "calibration.yaml");
  EXPECT_THAT(verdict, HasSubstr("# accepted\n"));
  EXPECT_THAT(verdict, EndsWith(text));

  stand_still();  // the same standstill: nothing more to do
  EXPECT_EQ(fake_.run_posted(), 0U);
}

// on_error: restart
TEST_F(CalibrationComponentTest, WhatIsInForceStaysSoWhenItIsMadeAnew) {
  const auto T_camera_lidar = test::true_T_camera_lidar();
  Extrinsics in_force;
  in_force.version(3);
  in_force.applied(1);
  in_force.T_camera_lidar(conversion::to_array(T_camera_lidar));
  *fake_.restart_memory() = in_force;
  CalibrationComponent component(fake_);
  EXPECT_TRUE(fake_.published<Extrinsics>("extrinsics").empty());
  component.start();
  ASSERT_EQ(fake_.published<Extrinsics>("extrinsics").size(), 1U);
  EXPECT_EQ(*fake_.published<Extrinsics>("extrinsics")[0], in_force);
  stand_still();
  ASSERT_EQ(fake_.run_posted(std::chrono::minutes(2)), 1U);
  const auto published = fake_.published<Extrinsics>("extrinsics");
  ASSERT_GE(published.size(), 2U);
  EXPECT_EQ(published[1]->version(), 4U);
  // What the rig file says is off by a degree and a half, what is in force is right.
  const double before = -published[1]->cost_before();
  EXPECT_GT(before, 0.9 * -published[1]->cost_after());
}

TEST_F(CalibrationComponentTest, InLockstepItComputesAtOnceAndOnlyProposes) {
  fake_.set_parameter("lockstep", true);
  CalibrationComponent component(fake_);
  stand_still();
  const auto published = fake_.published<Extrinsics>("extrinsics");
  ASSERT_EQ(published.size(), 1U);  // without waiting for a thread
  EXPECT_EQ(fake_.run_posted(), 0U);
  EXPECT_EQ(published[0]->applied(), 0);
  EXPECT_FALSE(fake_.restart_memory()->has_value());
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("proposed"));
  EXPECT_THAT(text_of(folder_ / "results" / "calibration.yaml"), HasSubstr("# accepted\n"));
  // One for each frame, so that a replay can wait.
  EXPECT_EQ(fake_.published<camvox_interfaces::msg::Progress>("progress").size(), 2U);
}

TEST_F(CalibrationComponentTest, AFrameThatIsNotWholeIsLeftBehind) {
  CalibrationComponent component(fake_);
  for (int i = 0; i < 20; ++i) send_cloud(i * kSecond_ns, false, false);
  send_image(19 * kSecond_ns);
  EXPECT_EQ(fake_.published<camvox_interfaces::msg::Progress>("progress").size(), 1U);
  fake_.verify_nothing_left();
}

TEST_F(CalibrationComponentTest, MotionCancels) {
  CalibrationComponent component(fake_);
  stand_still();
  send_cloud(2 * kSecond_ns, false, false);
  fake_.run_posted(std::chrono::seconds(20));  // the cancelled one reports, and is ignored
  EXPECT_TRUE(fake_.published<Extrinsics>("extrinsics").empty());
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("cancelled"));
}

TEST_F(CalibrationComponentTest, WaitsForStandstillAndForItsInterval) {
  fake_.set_parameter("automatic", false);
  CalibrationComponent component(fake_);
  stand_still();
  EXPECT_EQ(fake_.run_posted(), 0U);
  EXPECT_TRUE(fake_.published<Extrinsics>("extrinsics").empty());
}

TEST_F(CalibrationComponentTest, TheNextStandstillHasItsTurnAfterTheInterval) {
  fake_.set_parameter("camera.width_px", std::int64_t{800});
  fake_.set_parameter("min_interval_s", 60.0);
  CalibrationComponent component(fake_);
  EXPECT_EQ(runs_at(100 * kSecond_ns, true), 1U);
  move(110 * kSecond_ns);
  EXPECT_EQ(runs_at(159 * kSecond_ns, false), 0U) << "59 s";
  move(165 * kSecond_ns);
  EXPECT_EQ(runs_at(170 * kSecond_ns, true), 1U);
}

TEST_F(CalibrationComponentTest, AClockThatWasSetBackDoesNotStopIt) {
  fake_.set_parameter("camera.width_px", std::int64_t{800});
  CalibrationComponent component(fake_);
  EXPECT_EQ(runs_at(1000 * kSecond_ns, true), 1U);
  move(1010 * kSecond_ns);
  EXPECT_EQ(runs_at(5 * kSecond_ns, true), 1U);
}

TEST_F(CalibrationComponentTest, NamesWhatIsWrong) {
  fake_.set_parameter("camera.width_px", std::int64_t{800});
  CalibrationComponent component(fake_);
  stand_still();
  ASSERT_EQ(fake_.run_posted(std::chrono::seconds(60)), 1U);
  EXPECT_TRUE(fake_.published<Extrinsics>("extrinsics").empty());
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("size"));
}

}  // namespace
}  // namespace camvox
