#include "camvox/dense_map/dense_map_component.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/pose.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::DepthImage;
using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::FramePose;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::MapUpdate;
using camvox_interfaces::msg::Progress;
using sensor_msgs::msg::PointCloud2;
using ::testing::HasSubstr;

constexpr std::uint32_t kWidth = 64;
constexpr std::uint32_t kHeight = 48;

class DenseMapTest : public testing::Test {
 protected:
  DenseMapTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    fake_.set_parameter("output_dir", folder_.string());
    fake_.set_parameter("camera.width_px", std::int64_t{kWidth});
    fake_.set_parameter("camera.height_px", std::int64_t{kHeight});
    fake_.set_parameter("camera.fx_px", 50.0);
    fake_.set_parameter("camera.fy_px", 50.0);
    fake_.set_parameter("camera.cx_px", 31.5);
    fake_.set_parameter("camera.cy_px", 23.5);
    fake_.set_parameter("camera.distortion", std::vector<double>{});
  }

  void send_images(std::uint64_t frame_id) {
    fake_.send<FrameImage>("frame_image", [&](FrameImage& image) {
      image.header().frame_id(frame_id);
      image.width_px(kWidth);
      image.height_px(kHeight);
      image.row_step_bytes(3 * kWidth);
      image.encoding(camvox_interfaces::msg::ENCODING_RGB8);
      image.data_count(3 * kWidth * kHeight);
      for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) {
        image.data()[3 * i] = 10;
        image.data()[3 * i + 1] = 20;
        image.data()[3 * i + 2] = 30;
      }
    });
    fake_.send<DepthImage>("depth_image", [&](DepthImage& depth) {
      depth.header().frame_id(frame_id);
      depth.width_px(kWidth);
      depth.height_px(kHeight);
      depth.depth_m_count(kWidth * kHeight);
      depth.sigma_m_count(kWidth * kHeight);
      for (std::uint32_t i = 0; i < kWidth * kHeight; ++i) {
        depth.depth_m()[i] = 5.0F;
        depth.sigma_m()[i] = 0.02F;
      }
    });
  }

  void send_pose(std::uint64_t frame_id, std::uint64_t reference_id) {
    FramePose pose;
    pose.header().frame_id(frame_id);
    pose.reference_keyframe_id(reference_id);
    fake_.send("frame_pose", pose);
  }

  void send_keyframe(std::uint64_t id, std::uint64_t frame_id) {
    fake_.send<Keyframe>("keyframe", [&](Keyframe& keyframe) {
      keyframe.id(id);
      keyframe.header().frame_id(frame_id);
      keyframe.T_map_camera(conversion::to_array(geometry::SE3()));
    });
  }

  [[nodiscard]] std::vector<std::array<float, 3>> published_points() const {
    const auto clouds = fake_.published<PointCloud2>("dense_map");
    std::vector<std::array<float, 3>> points(clouds.empty() ? 0 : clouds.back()->width());
    for (std::size_t i = 0; i < points.size(); ++i) {
      std::memcpy(points[i].data(), clouds.back()->data().data() + 16 * i, 12);
    }
    return points;
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("dense_" + std::to_string(getpid()));
  FakeContext fake_;
};

TEST_F(DenseMapTest, StreamsThePointsOfKeyframesOnly) {
  DenseMapComponent component(fake_);
  send_images(1);
  send_images(2);
  send_keyframe(1, 2);
  fake_.advance(std::chrono::seconds(2));
  const auto points = published_points();
  ASSERT_GT(points.size(), 500U);
  EXPECT_NEAR(points[0][2], 5.0, 1e-5);
  const auto cloud = fake_.published<PointCloud2>("dense_map").back();
  EXPECT_EQ(cloud->header().frame_id(), "map");
  std::uint32_t rgb = 0;
  std::memcpy(&rgb, cloud->data().data() + 12, 4);
  EXPECT_EQ(rgb, (10U << 16) | (20U << 8) | 30U);
  component.stop();
}

TEST_F(DenseMapTest, AFrameIsDoneWhenItsPointsAreInWhateverComesFirst) {
  DenseMapComponent component(fake_);
  const auto done = [&] { return fake_.published<Progress>("progress").size(); };
  send_pose(7, 1);
  EXPECT_EQ(done(), 0U) << "its keyframe is announced";
  send_keyframe(1, 7);
  EXPECT_EQ(done(), 0U) << "its images are missing";
  send_images(7);
  EXPECT_EQ(done(), 1U);
  send_images(8);
  send_pose(8, 1);
  EXPECT_EQ(done(), 2U) << "no keyframe";
  component.stop();
}

TEST_F(DenseMapTest, PointsFollowTheMap) {
  DenseMapComponent component(fake_);
  send_images(1);
  send_keyframe(1, 1);
  fake_.send<MapUpdate>("map_update", [](MapUpdate& update) {
    update.keyframe_ids()[0] = 1;
    update.keyframe_poses()[0] =
        conversion::to_array(geometry::SE3(geometry::SO3(), {0.0, 0.0, 100.0}));
    update.keyframe_ids_count(1);
    update.keyframe_poses_count(1);
  });
  fake_.advance(std::chrono::seconds(2));
  EXPECT_NEAR(published_points()[0][2], 105.0, 1e-4);
  component.stop();
}

TEST_F(DenseMapTest, FramesInALoadedMapAreDoneAtOnce) {
  DenseMapComponent component(fake_);
  send_pose(1, 33);
  EXPECT_TRUE(fake_.published<Progress>("progress").empty());
  fake_.send<Keyframe>("map_keyframe", [](Keyframe& keyframe) { keyframe.id(33); });
  EXPECT_EQ(fake_.published<Progress>("progress").size(), 1U);
  component.stop();
}

TEST_F(DenseMapTest, SavesPcdPlyAndPicture) {
  DenseMapComponent component(fake_);
  send_images(1);
  send_keyframe(1, 1);
  component.stop();
  const auto begins_with = [&](const char* name, const std::string& magic) {
    std::ifstream file(folder_ / name, std::ios::binary);
    std::string start(magic.size(), '\0');
    file.read(start.data(), static_cast<std::streamsize>(start.size()));
    return start == magic;
  };
  EXPECT_TRUE(begins_with("dense_map.pcd", "# .PCD"));
  EXPECT_TRUE(begins_with("dense_map.ply", "ply"));
  EXPECT_TRUE(begins_with("dense_map.png", "\x89PNG"));
  EXPECT_THAT(fake_.log_entries().back().text, HasSubstr("dense map: "));
}

TEST_F(DenseMapTest, AFolderThatIsGoneIsAnErrorForEachFile) {
  DenseMapComponent component(fake_);
  send_images(1);
  send_keyframe(1, 1);
  std::filesystem::remove_all(folder_);
  EXPECT_THROW(component.stop(), std::runtime_error);
  ASSERT_EQ(fake_.log_entries().size(), 4U);
  EXPECT_THAT(fake_.log_entries()[0].text, HasSubstr("dense_map.pcd: cannot be written"));
}

TEST_F(DenseMapTest, OldImagesAreLetGo) {
  DenseMapComponent component(fake_);
  for (std::uint64_t frame = 1; frame <= 20; ++frame) send_images(frame);
  EXPECT_EQ(fake_.subscription_stats("frame_image").starved, 0U);
  for (std::uint64_t id = 1; id <= 10; ++id) send_keyframe(id, id);
  EXPECT_EQ(fake_.diagnostics().status().values["keyframes without images"], "2");
  component.stop();
}

}  // namespace
}  // namespace camvox
