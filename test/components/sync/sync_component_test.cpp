#include "camvox/sync_component/sync_component.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "sync_fixture.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::DepthImage;
using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::Progress;
using camvox_interfaces::msg::Scan;
using livox_ros_driver2::msg::CustomMsg;
using sensor_msgs::msg::Image;
using test::grey_image;
using test::imu_message;
using test::kHeight;
using test::kMs;
using test::kStart_ns;
using test::kWidth;
using test::livox_message;
using test::SyncTest;
using ::testing::HasSubstr;

/// Time of a return in ms after the start, as livox_message wrote it into x.
double time_ms(const Scan& scan, std::size_t i) {
  return static_cast<double>(scan.points()[i][0]) - 1000.0;
}

TEST_F(SyncTest, PairsAnImageWithTheReturnsBeforeIt) {
  make();
  imu_between(0, 300);
  scan_at(0);
  scan_at(100);
  image_at(200, 77);
  ASSERT_EQ(scans().size(), 1U);
  ASSERT_EQ(images().size(), 1U);
  const auto& scan = *scans()[0];
  EXPECT_EQ(scan.header().frame_id(), 1U);
  EXPECT_EQ(images()[0]->header().frame_id(), 1U);
  EXPECT_EQ(images()[0]->header().stamp_ns(), kStart_ns + 200 * kMs);
  EXPECT_EQ(scan.image_stamp_ns(), kStart_ns + 200 * kMs);
  EXPECT_EQ(scan.header().stamp_ns(), kStart_ns + 100 * kMs);
  ASSERT_EQ(scan.points_count(), 100U);
  EXPECT_DOUBLE_EQ(time_ms(scan, 0), 100.0);
  EXPECT_DOUBLE_EQ(time_ms(scan, 99), 199.0);
  EXPECT_EQ(scan.point_offset_ns()[99], 99 * kMs);
  EXPECT_EQ(scan.point_line()[99], 3);
  EXPECT_EQ(images()[0]->data()[kWidth * kHeight - 1], 77);
  EXPECT_EQ(images()[0]->data_count(), kWidth * kHeight);
}

TEST_F(SyncTest, IdsGoOnFarAboveThoseOfTheRunBefore) {
  fake_.set_earlier_runs(2);
  make();
  scan_at(0);
  imu_between(0, 300);
  image_at(100);
  ASSERT_EQ(images().size(), 1U);
  EXPECT_EQ(images()[0]->header().frame_id(), (std::uint64_t{2} << 32U) + 1);
}

// Defect 11 of CamVox: the image there gets the stamp of the scan before.
TEST_F(SyncTest, KeepsTheImagesOwnStampWhateverThePhaseOfTheScans) {
  make();
  imu_between(0, 400);
  for (const std::int64_t ms : {0, 100, 200}) scan_at(ms);
  image_at(237);
  ASSERT_EQ(scans().size(), 1U);
  const auto& scan = *scans()[0];
  EXPECT_EQ(scan.image_stamp_ns(), kStart_ns + 237 * kMs);
  ASSERT_EQ(scan.points_count(), 100U);
  EXPECT_DOUBLE_EQ(time_ms(scan, 0), 137.0);
  EXPECT_DOUBLE_EQ(time_ms(scan, 99), 236.0);
}

TEST_F(SyncTest, ScanCarriesTheImuSamplesThatSpanItAndOneMoreOnEitherSide) {
  make();
  imu_between(0, 300);
  scan_at(0);
  scan_at(100);
  image_at(205);
  ASSERT_EQ(scans().size(), 0U);  // 205 ms is not there yet
  scan_at(200);
  ASSERT_EQ(scans().size(), 1U);
  const auto& scan = *scans()[0];
  ASSERT_GT(scan.imu_count(), 2U);
  EXPECT_EQ(scan.imu_stamp_ns()[0], kStart_ns + 105 * kMs);
  EXPECT_EQ(scan.imu_stamp_ns()[scan.imu_stamp_ns_count() - 1], kStart_ns + 205 * kMs);
}

TEST_F(SyncTest, SpansTheTimeSinceThePreviousImageWithImuSamples) {
  make();
  fake_.set_now_ns(kStart_ns);
  imu_between(0, 600);
  for (std::int64_t ms = 0; ms < 600; ms += 100) scan_at(ms);
  image_at(200);
  image_at(500);
  ASSERT_EQ(scans().size(), 2U);
  EXPECT_EQ(scans()[1]->imu_stamp_ns()[0], kStart_ns + 200 * kMs);
}

TEST_F(SyncTest, AnAfterWindowWaitsForTheReturnsToCome) {
  fake_.set_parameter("scan_window", std::string("after"));
  make();
  scan_at(0);
  image_at(100);
  imu_between(0, 300);
  EXPECT_TRUE(scans().empty());
  scan_at(100);
  ASSERT_EQ(scans().size(), 1U);
  EXPECT_DOUBLE_EQ(time_ms(*scans()[0], 0), 100.0);
  EXPECT_EQ(scans()[0]->points_count(), 100U);
}

TEST_F(SyncTest, AppliesTheTimeOffsets) {
  fake_.set_parameter("rig.camera_time_offset_ns", -30 * kMs);
  fake_.set_parameter("rig.imu_time_offset_ns", 1 * kMs);
  make();
  imu_between(0, 300);
  scan_at(0);
  scan_at(100);
  image_at(230);
  ASSERT_EQ(scans().size(), 1U);
  EXPECT_EQ(scans()[0]->image_stamp_ns(), kStart_ns + 200 * kMs);
  EXPECT_EQ(scans()[0]->imu_stamp_ns()[0], kStart_ns + 96 * kMs);
}

TEST_F(SyncTest, AMissingScanGivesAFrameWithoutPointsAndIsReported) {
  make();
  imu_between(0, 1000);
  scan_at(0);
  image_at(100);
  image_at(300);
  EXPECT_EQ(scans().size(), 1U);
  fake_.advance(std::chrono::milliseconds(200));
  ASSERT_EQ(scans().size(), 2U);
  EXPECT_EQ(scans()[1]->points_count(), 0U);
  EXPECT_EQ(scans()[1]->header().frame_id(), 2U);
  EXPECT_EQ(images().size(), 2U);
  EXPECT_EQ(counter("frames.without_lidar"), 1U);
}

TEST_F(SyncTest, ASensorThatStoppedIsNotWaitedForUntilItReturns) {
  make();
  scan_at(0);
  imu_between(0, 100);
  image_at(100);
  fake_.advance(std::chrono::seconds(2));
  image_at(200);
  fake_.advance(std::chrono::milliseconds(200));  // the lidar is given up now, and the IMU
  ASSERT_EQ(scans().size(), 2U);
  image_at(300);
  ASSERT_EQ(scans().size(), 3U);  // at once
  fake_.advance(std::chrono::seconds(1));
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kWarn);
  scan_at(300);
  imu_between(300, 400);
  image_at(400);
  scan_at(400);
  ASSERT_EQ(scans().size(), 4U);
  EXPECT_EQ(scans()[3]->points_count(), 100U);
}

TEST_F(SyncTest, LateDuplicateAndStrayImagesMakeNoFrame) {
  make();
  imu_between(0, 500);
  for (const std::int64_t ms : {0, 100, 200}) scan_at(ms);
  image_at(200);
  image_at(200);        // again
  image_at(150);        // late
  image_at(3'600'000);  // a glitch
  image_at(300);
  ASSERT_EQ(images().size(), 2U);
  EXPECT_EQ(images()[1]->header().frame_id(), 2U);
  EXPECT_EQ(images()[1]->header().stamp_ns(), kStart_ns + 300 * kMs);
  const auto progress = fake_.published<Progress>("progress");
  ASSERT_EQ(progress.size(), 4U);  // all but the duplicate
  EXPECT_EQ(progress[1]->header().frame_id(), 0U);
  EXPECT_EQ(counter("image.duplicates"), 1U);
  EXPECT_EQ(counter("image.late"), 1U);
  EXPECT_EQ(counter("image.suspects"), 1U);
  EXPECT_EQ(counter("frames.left_out"), 2U);
  component_->stop();
  EXPECT_EQ(fake_.log_entries().back().text, "images: 4 came, of which 2 made no frame");
}

TEST_F(SyncTest, SaysNothingOfImagesOfWhichEachMadeAWholeFrame) {
  make();
  imu_between(0, 300);
  scan_at(0);
  scan_at(100);
  image_at(200);
  component_->stop();
  EXPECT_TRUE(fake_.log_entries().empty());
  image_at(900);  // of which the lidar has yet to tell
  component_->stop();
  EXPECT_EQ(fake_.log_entries().back().text, "images: 2 came, of which 1 still waited at the end");
}

TEST_F(SyncTest, FollowsAClockThatWasSetBack) {
  make();
  imu_between(10'000, 10'300);
  scan_at(10'000);
  scan_at(10'100);
  image_at(10'200);
  ASSERT_EQ(scans().size(), 1U);
  for (const std::int64_t ms : {0, 100, 200, 300}) {
    imu_between(ms, ms + 95);
    scan_at(ms);
    image_at(ms + 100);
  }
  imu_between(400, 500);
  ASSERT_GE(scans().size(), 3U);
  for (const auto& scan : scans()) {
    for (std::size_t i = 0; i < scan->points_count(); ++i) {
      const double age_ms =
          static_cast<double>(scan->image_stamp_ns() - kStart_ns) / kMs - time_ms(*scan, i);
      EXPECT_GT(age_ms, 0.0);
      EXPECT_LE(age_ms, 100.0);
    }
  }
  EXPECT_EQ(counter("lidar.clock_jumps"), 1U);
  EXPECT_EQ(counter("image.clock_jumps"), 1U);
}

// Defect 12 of CamVox: vectors that grow for ever.
TEST_F(SyncTest, MemoryStaysBoundedWhenImagesStop) {
  make();
  for (std::int64_t ms = 0; ms < 60'000; ms += 100) {
    fake_.send("lidar", livox_message(kStart_ns + ms * kMs, 100 * kMs, kMs / 100));
  }
  imu_between(0, 100'000);
  image_at(60'000);
  EXPECT_EQ(scans().size(), 1U);
  EXPECT_LE(counter("lidar.used"), 600U);
}

TEST_F(SyncTest, DetectsAccelerationInG) {
  make();
  imu_between(0, 300, 1.0);
  scan_at(0);
  scan_at(100);
  image_at(200);
  ASSERT_EQ(scans().size(), 1U);
  EXPECT_NEAR(scans()[0]->imu()[10][5], 9.80665, 1e-9);
}

TEST_F(SyncTest, SaysThatTheRigStandsStill) {
  make();
  imu_between(0, 1000);
  for (std::int64_t ms = 0; ms <= 900; ms += 100) scan_at(ms);
  for (std::int64_t ms = 100; ms <= 700; ms += 100) image_at(ms);
  image_at(800, 200);
  ASSERT_EQ(scans().size(), 8U);
  EXPECT_EQ(scans()[0]->stationary(), 0);
  EXPECT_EQ(scans()[6]->stationary(), 1);
}

TEST_F(SyncTest, TakesAnImageOnceWhenBothTransportsCarryIt) {
  make();
  imu_between(0, 300);
  scan_at(0);
  image_at(100);
  sensor_msgs::msg::CompressedImage compressed;
  test::set_stamp(compressed, kStart_ns + 100 * kMs);
  fake_.send("compressed_image", compressed);
  EXPECT_EQ(images().size(), 1U);
  EXPECT_EQ(counter("image.duplicates"), 1U);
  EXPECT_EQ(counter("image.malformed"), 0U);
}

TEST_F(SyncTest, ReadsTheOlderLivoxDriver) {
  fake_.set_parameter("depth_source", std::string("livox_interfaces"));
  make();
  imu_between(0, 300);
  scan_at(0);
  image_at(100);
  ASSERT_EQ(scans().size(), 1U);
  EXPECT_EQ(scans()[0]->points_count(), 100U);
}

TEST_F(SyncTest, ARollingShuttersFrameHasTheTimeOfItsMiddleRow) {
  fake_.set_parameter("row_time_s", 1e-4);
  make();
  imu_between(0, 300);
  scan_at(0);
  scan_at(100);
  image_at(150);
  ASSERT_EQ(scans().size(), 1U);
  EXPECT_EQ(scans()[0]->image_stamp_ns(), kStart_ns + 150 * kMs + 2'350'000);  // 23.5 rows
}

TEST_F(SyncTest, IgnoresImuSamplesThatAreNoNumbers) {
  make();
  auto broken = imu_message(kStart_ns);
  broken.angular_velocity().x(std::nan(""));
  fake_.send("imu", broken);
  EXPECT_EQ(counter("imu.malformed"), 1U);
  EXPECT_EQ(counter("imu.used"), 0U);
}

TEST_F(SyncTest, BadParametersStopTheStartWithAllProblems) {
  fake_.set_parameter("camera.distortion", std::vector<double>(9, 0.0));
  fake_.set_parameter("rig.T_imu_lidar.rotation_xyzw", std::vector<double>(4, 0.0));
  try {
    make();
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_GE(error.problems().size(), 2U);
  }
}

TEST_F(SyncTest, ReportsACameraThatIsNotTheConfiguredOne) {
  make();
  sensor_msgs::msg::CameraInfo info;
  info.width(kWidth + 2);
  info.height(kHeight);
  fake_.send("camera_info", info);
  fake_.advance(std::chrono::seconds(1));
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kError);
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("66x48"));
}

TEST_F(SyncTest, LeavesOutImagesOfAnotherSize) {
  make();
  fake_.send("image", grey_image(kStart_ns, kWidth - 1, kHeight));
  EXPECT_TRUE(images().empty());
  EXPECT_EQ(fake_.published<Progress>("progress").size(), 1U);
  fake_.advance(std::chrono::seconds(1));
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kError);
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("63x48"));
  EXPECT_EQ(fake_.outstanding_loans("frame_image"), 0U);
}

TEST_F(SyncTest, ReportsClocksThatAreApart) {
  make();
  image_at(100);
  scan_at(50'000);
  fake_.advance(std::chrono::seconds(1));
  EXPECT_EQ(fake_.diagnostics().status().level, HealthLevel::kError);
  EXPECT_THAT(fake_.diagnostics().status().message, HasSubstr("lidar stamps are +49.999 s"));
}

TEST_F(SyncTest, EstimatesTheResidualOffsetOfTheTrigger) {
  make();
  imu_between(0, 4000);
  for (std::int64_t ms = 0; ms < 3000; ms += 100) {
    scan_at(ms);
    image_at(ms + 4);
  }
  fake_.advance(std::chrono::seconds(1));
  const auto values = fake_.diagnostics().status().values;
  EXPECT_NEAR(std::stod(values.at("image_to_scan_offset_s")), 0.004, 1e-6);
  EXPECT_NEAR(std::stod(values.at("image_to_scan_offset_jitter_s")), 0.0, 1e-6);
}

/// What sync makes of fixed streams that reach it in some order: the streams' own order is fixed
/// (one scan comes late), how they interleave is not.
std::vector<std::int64_t> frames_of(const std::string& order) {
  FakeContext fake("sync");
  fake.set_parameter("camera.width_px", std::int64_t{kWidth});
  fake.set_parameter("camera.height_px", std::int64_t{kHeight});
  fake.set_parameter("lockstep", true);
  SyncComponent component(fake);
  const std::vector<std::int64_t> scans = {0, 100, 300, 200, 400, 500, 600, 700};
  std::size_t scan = 0, image = 0, imu = 0;
  for (const char next : order) {
    if (next == 'l' && scan < scans.size()) {
      fake.send("lidar", livox_message(kStart_ns + scans[scan++] * kMs, 99 * kMs));
    } else if (next == 'c' && image < 5) {
      const auto ms = static_cast<std::int64_t>(100 * ++image);
      fake.send("image", grey_image(kStart_ns + ms * kMs, kWidth, kHeight));
    }
    for (int i = 0; next == 'i' && i < 20; ++i) {
      fake.send("imu", imu_message(kStart_ns + 5 * kMs * static_cast<std::int64_t>(imu++)));
    }
    fake.advance(std::chrono::seconds(1));  // the machine is busy
  }
  std::vector<std::int64_t> frames;
  for (const auto& made : fake.published<Scan>("scan")) {
    frames.insert(frames.end(),
                  {made->header().stamp_ns(), made->points_count(), made->imu_count()});
  }
  return frames;
}

TEST_F(SyncTest, LockstepFramesDoNotDependOnHowTheTopicsInterleave) {
  const auto in_turn = frames_of("lilicilicilicilicilicilili");
  ASSERT_EQ(in_turn.size(), 5U * 3U);
  EXPECT_EQ(in_turn[3 * 2 + 1], 99);  // the frame of the late scan
  EXPECT_EQ(frames_of("ccccclllllllliiiiiiiii"), in_turn);
  EXPECT_EQ(frames_of("iiiiiiiiillllllllccccc"), in_turn);
  EXPECT_EQ(frames_of("lllliiiiiccllccclliiii"), in_turn);
}

class RgbdTest : public SyncTest {
 protected:
  RgbdTest() { fake_.set_parameter("depth_source", std::string("depth_image")); }
  void depth_at(std::int64_t ms, std::uint16_t depth_mm) {
    Image image = grey_image(kStart_ns + ms * kMs, kWidth, kHeight);
    image.encoding("16UC1");
    image.step(2 * kWidth);
    image.data().clear();
    for (std::size_t i = 0; i < std::size_t{kWidth} * kHeight; ++i) {
      image.data().push_back(static_cast<std::uint8_t>(depth_mm & 255U));
      image.data().push_back(static_cast<std::uint8_t>(depth_mm >> 8U));
    }
    fake_.send("depth", image);
  }
  [[nodiscard]] std::vector<std::shared_ptr<const DepthImage>> depths() const {
    return fake_.published<DepthImage>("depth_image");
  }
};

TEST_F(RgbdTest, PairsTheNearestDepthImage) {
  make();
  depth_at(0, 1000);
  depth_at(34, 1100);
  image_at(30);
  depth_at(67, 1200);
  image_at(63);
  depth_at(100, 1300);
  ASSERT_EQ(depths().size(), 2U);
  EXPECT_FLOAT_EQ(depths()[0]->depth_m()[5], 1.1F);
  EXPECT_FLOAT_EQ(depths()[1]->depth_m()[5], 1.2F);
  EXPECT_EQ(depths()[0]->header().stamp_ns(), kStart_ns + 30 * kMs);
  EXPECT_EQ(depths()[0]->header().frame_id(), 1U);
  EXPECT_EQ(images()[0]->header().frame_id(), 1U);
  EXPECT_EQ(depths()[0]->depth_m_count(), kWidth * kHeight);
}

TEST_F(RgbdTest, AnImageWithoutDepthGetsAnEmptyDepthImage) {
  make();
  depth_at(0, 1000);
  image_at(300);
  fake_.advance(std::chrono::milliseconds(200));
  ASSERT_EQ(depths().size(), 1U);
  EXPECT_EQ(depths()[0]->depth_m_count(), 0U);
  EXPECT_EQ(images().size(), 1U);
}

}  // namespace
}  // namespace camvox
