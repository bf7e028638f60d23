#include "camvox/depth_component/depth_component.hpp"

#include <gmock/gmock.h>

#include <cstring>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Cloud;
using camvox_interfaces::msg::DepthImage;
using camvox_interfaces::msg::Extrinsics;
using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::Progress;
using sensor_msgs::msg::CameraInfo;
using sensor_msgs::msg::Image;
using sensor_msgs::msg::PointCloud2;

constexpr int kWidth = 160;
constexpr int kHeight = 120;

class DepthTest : public testing::Test {
 protected:
  DepthTest() {
    fake_.set_parameter("camera.width_px", std::int64_t{kWidth});
    fake_.set_parameter("camera.height_px", std::int64_t{kHeight});
    fake_.set_parameter("camera.fx_px", 150.0);
    fake_.set_parameter("camera.fy_px", 150.0);
    fake_.set_parameter("camera.cx_px", 79.5);
    fake_.set_parameter("camera.cy_px", 59.5);
    fake_.set_parameter("camera.distortion", std::vector<double>{});
    fake_.set_parameter("rig.T_lidar_camera.translation_m", std::vector<double>{0.0, 0.0, 0.0});
  }

  void set_readers(std::size_t count) {
    for (const auto* topic : {"depth", "depth_mm", "camera_info", "coloured_cloud"}) {
      fake_.set_subscriber_count(topic, count);
    }
  }

  /// A wall across the view, `x_m` ahead of the lidar (whose x axis looks forward).
  void send_wall(std::uint64_t frame_id, float x_m) {
    fake_.send<Cloud>("cloud", [&](Cloud& cloud) {
      cloud.header().frame_id(frame_id);
      cloud.header().stamp_ns(static_cast<std::int64_t>(frame_id) * 1'000'000'007);
      std::uint32_t count = 0;
      for (int i = -60; i <= 60; ++i) {
        for (int k = -50; k <= 50; ++k) {
          cloud.points()[count++] = {
              x_m, 0.01F * static_cast<float>(i) * x_m, 0.01F * static_cast<float>(k) * x_m, 9.0F};
        }
      }
      cloud.points_count(count);
    });
  }

  /// RGB 10 20 30 in the left half, 110 120 130 in the right one.
  void send_image(std::uint64_t frame_id) {
    fake_.send<FrameImage>("frame_image", [&](FrameImage& image) {
      image.header().frame_id(frame_id);
      image.width_px(kWidth);
      image.height_px(kHeight);
      image.row_step_bytes(3 * kWidth);
      image.encoding(camvox_interfaces::msg::ENCODING_RGB8);
      image.data_count(3 * kWidth * kHeight);
      for (std::uint32_t i = 0; i < image.data_count(); ++i) {
        const auto base = i % (3 * kWidth) < 3 * kWidth / 2 ? 10U : 110U;
        image.data()[i] = static_cast<std::uint8_t>(base + 10 * (i % 3));
      }
    });
  }

  struct Calibrated {
    std::uint64_t version;
    std::uint8_t applied;
    double forward_m;  ///< Of the lidar, so that the wall is as much farther from the camera.
    std::int64_t stamp_ns = 0;
  };
  void send_extrinsics(const Calibrated& calibrated) {
    Extrinsics extrinsics;
    extrinsics.version(calibrated.version);
    extrinsics.applied(calibrated.applied);
    extrinsics.header().stamp_ns(calibrated.stamp_ns);
    const geometry::SO3 R_camera_lidar(Eigen::Quaterniond(-0.5, 0.5, -0.5, 0.5).conjugate());
    extrinsics.T_camera_lidar(
        conversion::to_array(geometry::SE3(R_camera_lidar, {0.0, 0.0, calibrated.forward_m})));
    fake_.send("extrinsics", extrinsics);
  }
  std::shared_ptr<const DepthImage> depth_now() {
    send_wall(1, 10.0F);
    return fake_.published<DepthImage>("depth_image").back();
  }

  static float centre_m(const DepthImage& depth) {
    return depth.depth_m()[kWidth * (kHeight / 2) + kWidth / 2];
  }

  FakeContext fake_;
};

TEST_F(DepthTest, DepthIsZOfTheWallEverywhere) {
  DepthComponent component(fake_);
  send_wall(7, 10.0F);
  const auto images = fake_.published<DepthImage>("depth_image");
  ASSERT_EQ(images.size(), 1U);
  const auto& depth = *images[0];
  EXPECT_EQ(depth.header().frame_id(), 7U);
  EXPECT_EQ(depth.width_px(), 160U);
  ASSERT_EQ(depth.depth_m_count(), static_cast<std::uint32_t>(kWidth * kHeight));
  int filled = 0;
  for (std::uint32_t i = 0; i < depth.depth_m_count(); ++i) {
    if (depth.depth_m()[i] == 0.0F) continue;
    ++filled;
    EXPECT_NEAR(depth.depth_m()[i], 10.0F, 0.02F) << "range would be 11.1 m at the border";
    EXPECT_GT(depth.sigma_m()[i], 0.0F);
  }
  EXPECT_GT(filled, kWidth * kHeight * 9 / 10);
  EXPECT_EQ(fake_.published<Progress>("progress").size(), 1U);
}

TEST_F(DepthTest, ACloudWithoutPointsGivesAnEmptyImage) {
  DepthComponent component(fake_);
  fake_.send<Cloud>("cloud", [](Cloud& cloud) { cloud.header().frame_id(3); });
  const auto images = fake_.published<DepthImage>("depth_image");
  ASSERT_EQ(images.size(), 1U);
  EXPECT_EQ(images[0]->header().frame_id(), 3U);
  EXPECT_EQ(images[0]->depth_m_count(), 0U);
  EXPECT_EQ(images[0]->height_px(), 120U);
}

TEST_F(DepthTest, OnlyExtrinsicsThatPassedTakeEffectAndOnlyNewerOnes) {
  DepthComponent component(fake_);
  const auto send = [&](std::uint64_t version, std::uint8_t applied, double forward_m) {
    send_extrinsics({.version = version, .applied = applied, .forward_m = forward_m});
  };
  send(5, 0, 1.0);
  EXPECT_NEAR(centre_m(*depth_now()), 10.0F, 0.02F) << "a proposal";
  EXPECT_EQ(depth_now()->extrinsics_version(), 0U);
  send(6, 1, 1.0);
  EXPECT_NEAR(centre_m(*depth_now()), 11.0F, 0.02F);
  EXPECT_EQ(depth_now()->extrinsics_version(), 6U);
  send(4, 1, 2.0);
  EXPECT_NEAR(centre_m(*depth_now()), 11.0F, 0.02F) << "an old one, late";
}

TEST_F(DepthTest, ACalibrationThatWasRestartedIsHeard) {
  DepthComponent component(fake_);
  send_extrinsics({.version = 3, .applied = 1, .forward_m = 1.0, .stamp_ns = 300});
  EXPECT_NEAR(centre_m(*depth_now()), 11.0F, 0.02F);
  send_extrinsics({.version = 1, .applied = 1, .forward_m = 2.0, .stamp_ns = 400});
  EXPECT_NEAR(centre_m(*depth_now()), 12.0F, 0.02F) << "it counts from one again";
  EXPECT_EQ(depth_now()->extrinsics_version(), 1U);
}

TEST_F(DepthTest, EdgeTopicsAreSentWhileSomebodyReadsThem) {
  DepthComponent component(fake_);
  set_readers(0);
  send_wall(1, 10.0F);
  EXPECT_TRUE(fake_.published<Image>("depth").empty());
  set_readers(1);
  send_wall(2, 10.0F);
  const auto metres = fake_.published<Image>("depth").at(0);
  const auto millimetres = fake_.published<Image>("depth_mm").at(0);
  const auto depth = fake_.published<DepthImage>("depth_image").back();
  EXPECT_EQ(metres->encoding(), "32FC1");
  EXPECT_EQ(metres->step(), 640U);
  EXPECT_EQ(metres->header().stamp().sec(), 2);
  EXPECT_EQ(metres->header().stamp().nanosec(), 14U);
  EXPECT_EQ(millimetres->encoding(), "16UC1");
  const std::size_t centre = kWidth * (kHeight / 2) + kWidth / 2;
  float value_m = 0.0F;
  std::uint16_t value_mm = 0;
  std::memcpy(&value_m, metres->data().data() + 4 * centre, 4);
  std::memcpy(&value_mm, millimetres->data().data() + 2 * centre, 2);
  EXPECT_EQ(value_m, centre_m(*depth));
  EXPECT_NEAR(value_mm, 1e3F * value_m, 0.51F);
  EXPECT_EQ(fake_.published<CameraInfo>("camera_info").at(0)->k()[0], 150.0);
}

TEST_F(DepthTest, ColouredCloudIsSentWhileSomebodyReadsIt) {
  DepthComponent component(fake_);
  set_readers(0);
  send_image(1);
  send_wall(1, 10.0F);
  EXPECT_TRUE(fake_.published<PointCloud2>("coloured_cloud").empty());
  set_readers(1);
  send_image(2);
  send_wall(2, 10.0F);
  send_wall(3, 10.0F);
  EXPECT_EQ(fake_.published<PointCloud2>("coloured_cloud").size(), 1U) << "waits for image 3";
  send_image(3);
  const auto clouds = fake_.published<PointCloud2>("coloured_cloud");
  ASSERT_EQ(clouds.size(), 2U);
  const auto& cloud = *clouds[1];
  EXPECT_EQ(cloud.header().stamp().sec(), 3);
  EXPECT_EQ(cloud.header().frame_id(), "camera_optical_frame");
  ASSERT_EQ(cloud.fields().size(), 4U);
  EXPECT_EQ(cloud.fields()[3].name(), "rgb");
  ASSERT_EQ(cloud.data().size(), std::size_t{cloud.width()} * cloud.point_step());
  // Columns from -0.53 to 0.53 rad and rows from -0.4 to 0.4 are in view, at steps of 0.01.
  EXPECT_NEAR(cloud.width(), 106 * 80, 400);
  for (std::uint32_t i = 0; i < cloud.width(); ++i) {
    const auto* row = cloud.data().data() + std::size_t{i} * cloud.point_step();
    float p[3];
    std::uint32_t rgb = 0;
    std::memcpy(p, row, 12);
    std::memcpy(&rgb, row + 12, 4);
    EXPECT_NEAR(p[2], 10.0F, 1e-4F) << "z is forward";
    if (std::abs(p[0]) < 0.1F) continue;  // beside the border of the two colours
    EXPECT_EQ(rgb, p[0] < 0.0F ? 0x0A141EU : 0x6E7882U) << p[0];
  }
}

TEST_F(DepthTest, ColouredCloudLeavesOutWhatANearerSurfaceHides) {
  DepthComponent component(fake_);
  const auto send_near_wall_and_one_behind = [&](bool with_one) {
    send_image(1);
    fake_.send<Cloud>("cloud", [&](Cloud& cloud) {
      cloud.header().frame_id(1);
      std::uint32_t count = 0;
      for (int i = -60; i <= 60; ++i) {
        for (int k = -50; k <= 50; ++k) {
          cloud.points()[count++] = {
              5.0F, 0.05F * static_cast<float>(i), 0.05F * static_cast<float>(k), 9.0F};
        }
      }
      if (with_one) cloud.points()[count++] = {20.0F, 0.5F, 0.5F, 9.0F};
      cloud.points_count(count);
    });
    return fake_.published<PointCloud2>("coloured_cloud").back()->width();
  };
  const auto without = send_near_wall_and_one_behind(false);
  EXPECT_EQ(send_near_wall_and_one_behind(true), without);
}

TEST_F(DepthTest, ACameraThatDoesNotFitIsRefused) {
  fake_.set_parameter("camera.width_px", std::int64_t{4000});
  fake_.set_parameter("camera.height_px", std::int64_t{3000});
  EXPECT_THROW(DepthComponent component(fake_), config::ConfigError);
}

}  // namespace
}  // namespace camvox
