#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/depth_component/depth_component.hpp"
#include "camvox/depth_component/scan_accumulator.hpp"

// A robot that drives and turns towards a slanted wall, and a lidar that sees little of it at a
// time: truth is the wall.
namespace camvox {
namespace {

namespace msg = camvox_interfaces::msg;
using geometry::SE3;
using geometry::SO3;
using msg::Cloud;
using msg::DepthImage;
using msg::FramePose;

constexpr int kWidth = 160, kHeight = 120, kReturns = 150;
constexpr double kFocal_px = 150.0, kPeriod_s = 0.1;
const Eigen::Vector3d kVelocityMap_m_s(0.3, 0.0, 2.0);
const Eigen::Vector3d kOmegaCamera_rad_s(0.0, 0.4, 0.0);
const SO3 kRCameraLidar(Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5).conjugate());
const Eigen::Vector3d kWallNormal = Eigen::Vector3d(0.2, 0.1, 1.0).normalized();
constexpr double kWallDistance_m = 15.0;

/// The camera of frame `id`, in axes of the first.
SE3 T_map_camera(std::uint64_t id) {
  const double t_s = kPeriod_s * static_cast<double>(id);
  return {SO3::exp(t_s * kOmegaCamera_rad_s), t_s * kVelocityMap_m_s};
}

/// How far the wall is along a direction of the camera.
double distance_m(std::uint64_t id, const Eigen::Vector3d& f_camera) {
  const SE3 T = T_map_camera(id);
  return (kWallDistance_m - kWallNormal.dot(T.translation())) /
         kWallNormal.dot(T.rotation() * f_camera);
}

class AccumulationTest : public ::testing::Test {
 protected:
  [[nodiscard]] std::unique_ptr<FakeContext> context(int scans, bool lockstep = true) const {
    auto fake = std::make_unique<FakeContext>("depth");
    fake->set_parameter("accumulate_scans", std::int64_t{scans});
    fake->set_parameter("lockstep", lockstep);
    fake->set_parameter("camera.width_px", std::int64_t{kWidth});
    fake->set_parameter("camera.height_px", std::int64_t{kHeight});
    fake->set_parameter("camera.fx_px", kFocal_px);
    fake->set_parameter("camera.fy_px", kFocal_px);
    fake->set_parameter("camera.cx_px", 79.5);
    fake->set_parameter("camera.cy_px", 59.5);
    fake->set_parameter("camera.distortion", std::vector<double>{});
    fake->set_parameter("rig.T_lidar_camera.translation_m", std::vector<double>{0.0, 0.0, 0.0});
    return fake;
  }

  static void send_cloud(FakeContext& fake, std::uint64_t id) {
    std::mt19937 random(static_cast<unsigned>(id));
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    const SO3 R_lidar_camera = kRCameraLidar.inverse();
    const Eigen::Vector3d omega = R_lidar_camera * kOmegaCamera_rad_s;
    const Eigen::Vector3d v =
        R_lidar_camera * (T_map_camera(id).rotation().inverse() * kVelocityMap_m_s);
    fake.send<Cloud>("cloud", [&](Cloud& cloud) {
      cloud.header().frame_id(id);
      cloud.header().stamp_ns(static_cast<std::int64_t>(id) * 100'000'000);
      cloud.deskew(msg::DESKEW_GYRO_AND_VELOCITY);
      cloud.angular_velocity_lidar({omega.x(), omega.y(), omega.z()});
      cloud.velocity_lidar({v.x(), v.y(), v.z()});
      for (std::uint32_t i = 0; i < kReturns; ++i) {
        const double u = kWidth * unit(random) - 80.0;
        const double w = kHeight * unit(random) - 60.0;
        const Eigen::Vector3d f_camera(u / kFocal_px, w / kFocal_px, 1.0);
        const Eigen::Vector3f p =
            (R_lidar_camera * (distance_m(id, f_camera) * f_camera)).cast<float>();
        cloud.points()[i] = {p.x(), p.y(), p.z(), 9.0F};
      }
      cloud.points_count(kReturns);
    });
  }

  static void send_pose(FakeContext& fake, std::uint64_t id, std::uint8_t state) {
    FramePose pose;
    pose.header().frame_id(id);
    pose.header().stamp_ns(static_cast<std::int64_t>(id) * 100'000'000);
    pose.state(state);
    pose.T_map_camera(conversion::to_array(T_map_camera(id)));
    pose.T_keyframe_camera(pose.T_map_camera());
    fake.send("frame_pose", pose);
  }

  /// The depth image of frame `last`; frame `lost`, if any, is not tracked.
  static std::shared_ptr<const DepthImage> drive(FakeContext& fake,
                                                 std::uint64_t last,
                                                 std::uint64_t lost = 0) {
    DepthComponent component(fake);
    const auto& scans = fake.effective_parameters().at("accumulate_scans").value;
    const bool reads_poses = scans != config::Value(std::int64_t{1});
    for (std::uint64_t id = 1; id <= last; ++id) {
      send_cloud(fake, id);
      if (reads_poses && id < last)
        send_pose(fake, id, id == lost ? msg::TRACKING_LOST : msg::TRACKING_OK);
    }
    return fake.published<DepthImage>("depth_image").back();
  }

  struct Judgement {
    int filled = 0;
    double mean_m = 0.0;
    double worst_m = 0.0;
  };
  static Judgement judge(const DepthImage& depth, std::uint64_t id) {
    Judgement result;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const double z = static_cast<double>(depth.depth_m()[std::size_t(v * kWidth + u)]);
        if (z == 0.0) continue;
        const Eigen::Vector3d f((u - 79.5) / kFocal_px, (v - 59.5) / kFocal_px, 1.0);
        const double error_m = z - distance_m(id, f);
        ++result.filled;
        result.mean_m += error_m;
        result.worst_m = std::max(result.worst_m, std::abs(error_m));
      }
    }
    result.mean_m /= std::max(1, result.filled);
    return result;
  }
};

TEST_F(AccumulationTest, MoreIsFilledAndNothingIsMoved) {
  const auto one = context(1), five = context(5);
  const auto alone = judge(*drive(*one, 8), 8);
  const auto together = judge(*drive(*five, 8), 8);
  RecordProperty("filled_alone", alone.filled);
  RecordProperty("filled_together", together.filled);
  EXPECT_GT(together.filled, alone.filled + kWidth * kHeight / 10);
  EXPECT_GT(together.filled, kWidth * kHeight * 9 / 10);
  // Between two frames the model of the motion is good to 0.1 mm here; a turn taken the wrong way
  // round would move the wall by 2 m at the side.
  EXPECT_NEAR(together.mean_m, 0.0, 0.005);
  EXPECT_LT(together.worst_m, 0.05);
}

TEST_F(AccumulationTest, AfterALostFrameOlderScansAreLeftOut) {
  const auto one = context(1), five = context(5);
  const auto alone = drive(*one, 8);
  const auto after_lost = drive(*five, 8, 7);
  ASSERT_EQ(alone->depth_m_count(), after_lost->depth_m_count());
  for (std::uint32_t i = 0; i < alone->depth_m_count(); ++i) {
    ASSERT_EQ(alone->depth_m()[i], after_lost->depth_m()[i]);
  }
}

TEST_F(AccumulationTest, InLockstepACloudWaitsForThePoseBeforeIt) {
  const auto fake = context(3);
  DepthComponent component(*fake);
  const auto images = [&] { return fake->published<DepthImage>("depth_image").size(); };
  send_cloud(*fake, 1);
  EXPECT_EQ(images(), 1U) << "before the first there is nothing to wait for";
  send_cloud(*fake, 2);
  EXPECT_EQ(images(), 1U);
  send_pose(*fake, 1, msg::TRACKING_OK);
  EXPECT_EQ(images(), 2U);
  for (std::uint64_t id = 3; id < 8; ++id) send_cloud(*fake, id);
  EXPECT_EQ(images(), 3U) << "a bounded number waits; the oldest goes without";
}

TEST_F(AccumulationTest, LiveNothingWaits) {
  const auto fake = context(3, false);
  DepthComponent component(*fake);
  for (std::uint64_t id = 1; id <= 3; ++id) send_cloud(*fake, id);
  EXPECT_EQ(fake->published<DepthImage>("depth_image").size(), 3U);
}

TEST_F(AccumulationTest, FrameIdsThatGoBackBeginAnew) {
  depth_component::ScanAccumulator accumulator(3, {});
  FramePose pose;
  pose.state(msg::TRACKING_OK);
  pose.T_map_camera(conversion::to_array(SE3()));
  pose.T_keyframe_camera(pose.T_map_camera());
  const auto add = [&](std::uint64_t id) {
    pose.header().frame_id(id);
    pose.header().stamp_ns(pose.header().stamp_ns() + 100'000'000);
    accumulator.add_pose(pose);
  };
  for (std::uint64_t id = 1000; id < 1100; ++id) add(id);
  for (std::uint64_t id = 1; id < 4; ++id) EXPECT_NO_THROW(add(id));
}

TEST_F(AccumulationTest, ImpossibleNumbersAreRefused) {
  for (const int scans : {0, 21}) {
    const auto fake = context(scans);
    EXPECT_THROW(DepthComponent component(*fake), config::ConfigError);
  }
}

}  // namespace
}  // namespace camvox
