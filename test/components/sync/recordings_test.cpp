#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>

#include "camvox/component/fake_context.hpp"
#include "camvox/import/kitti_raw.hpp"
#include "camvox/import/seven_scenes.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/sync_component/sync_component.hpp"

// Imported recordings, message by message in the order of their log times, through the component.
namespace camvox {
namespace {

namespace fs = std::filesystem;
using camvox_interfaces::msg::DepthImage;
using camvox_interfaces::msg::FrameImage;
using camvox_interfaces::msg::Progress;
using camvox_interfaces::msg::Scan;

class Recording : public ::testing::Test {
 protected:
  Recording() : folder_(fs::temp_directory_path() / ("camvox_sync_" + std::to_string(getpid()))) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Recording() override { fs::remove_all(folder_); }

  void open(const storage::Result<import::ImportReport>& imported, const fs::path& bag) {
    ASSERT_TRUE(imported.ok()) << imported.status().message();
    auto reader = storage::BagReader::open(bag);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    reader_ = *std::move(reader);
  }

  /// Takes size and lens of the camera from the recording, as a rig file would have them.
  void configure_camera(FakeContext& fake) {
    for_each<sensor_msgs::msg::CameraInfo>(topics::kCameraInfo, [&](const auto& info) {
      fake.set_parameter("camera.width_px", std::int64_t{info.width()});
      fake.set_parameter("camera.height_px", std::int64_t{info.height()});
      fake.set_parameter("camera.fx_px", info.k()[0]);
      fake.set_parameter("camera.fy_px", info.k()[4]);
      fake.set_parameter("camera.cx_px", info.k()[2]);
      fake.set_parameter("camera.cy_px", info.k()[5]);
      fake.set_parameter("camera.distortion", std::vector<double>(5, 0.0));
    });
  }

  template <typename T, typename Callback>
  void for_each(std::string_view topic, Callback callback) {
    auto cursor = reader_->messages();
    while (const auto* logged = cursor.next()) {
      if (reader_->topics()[logged->topic].name == topic) callback(read<T>(*logged));
    }
  }

  /// Sends the first `max_images` images and all between; `ports` says which topic goes where.
  void play(FakeContext& fake,
            const std::map<std::string, std::string>& ports,
            std::size_t max_images) {
    auto cursor = reader_->messages();
    std::size_t images = 0;
    while (const auto* logged = cursor.next()) {
      const auto& topic = reader_->topics()[logged->topic];
      const auto port = ports.find(topic.name);
      if (port == ports.end()) continue;
      fake.set_now_ns(logged->log_time_ns);
      if (topic.type == "sensor_msgs/msg/CompressedImage") {
        if (++images > max_images) return;
        fake.send(port->second, read<sensor_msgs::msg::CompressedImage>(*logged));
      } else if (topic.type == "sensor_msgs/msg/Image") {
        fake.send(port->second, read<sensor_msgs::msg::Image>(*logged));
      } else if (topic.type == "sensor_msgs/msg/PointCloud2") {
        fake.send(port->second, read<sensor_msgs::msg::PointCloud2>(*logged));
      } else if (topic.type == "sensor_msgs/msg/Imu") {
        fake.send(port->second, read<sensor_msgs::msg::Imu>(*logged));
      } else {
        fake.send(port->second, read<sensor_msgs::msg::CameraInfo>(*logged));
      }
    }
  }

  template <typename T, typename Logged>
  [[nodiscard]] static T read(const Logged& logged) {
    T message;
    EXPECT_TRUE(interfaces::message_type<T>().read_cdr(
        reinterpret_cast<const std::uint8_t*>(logged.data.data()), logged.data.size(), &message));
    return message;
  }

  fs::path folder_;
  std::unique_ptr<storage::BagReader> reader_;
};

TEST_F(Recording, KittiDriveGivesAFullTurnCentredOnEveryImage) {
  const fs::path data = fs::path(SHARED_DATA) / "kitti_0013";
  if (!fs::exists(data)) GTEST_SKIP() << "no recording at " << data;
  import::KittiRawOptions options;
  options.output = folder_ / "bag";
  open(import::import_kitti_raw(data, options), options.output);
  constexpr std::size_t kImages = 30;
  FakeContext fake("sync");
  fake.set_parameter("depth_source", std::string("point_cloud"));
  fake.set_parameter("scan_window", std::string("centred"));
  fake.set_parameter("lockstep", true);
  configure_camera(fake);
  SyncComponent component(fake);
  play(fake,
       {{std::string(topics::kCompressedImage), "compressed_image"},
        {std::string(topics::kCameraInfo), "camera_info"},
        {"/velodyne_points", "lidar"},
        {"/imu/data", "imu"}},
       kImages);
  const auto scans = fake.published<Scan>("scan");
  const auto images = fake.published<FrameImage>("frame_image");
  EXPECT_GE(scans.size() + 2, kImages);  // the last ones still wait for returns
  ASSERT_EQ(scans.size(), images.size());
  for (std::size_t i = 0; i < scans.size(); ++i) {
    const auto& scan = *scans[i];
    EXPECT_EQ(scan.header().frame_id(), i + 1);
    EXPECT_EQ(images[i]->header().stamp_ns(), scan.image_stamp_ns());
    if (i == 0) continue;  // its window begins before the recording
    EXPECT_GT(scan.points_count(), 25'000U) << i;
    EXPECT_GE(scan.imu_count(), 2U);
    EXPECT_GE(scan.header().stamp_ns(), scan.image_stamp_ns() - 52'000'000);
    for (std::size_t p = 0; p < scan.points_count(); ++p) {
      ASSERT_LE(scan.header().stamp_ns() + scan.point_offset_ns()[p],
                scan.image_stamp_ns() + 50'000'000);
    }
  }
  fake.advance(std::chrono::seconds(1));
  EXPECT_NE(fake.diagnostics().status().level, HealthLevel::kError)
      << fake.diagnostics().status().message;
}

TEST_F(Recording, RedKitchenGivesADepthImageForEveryImage) {
  const fs::path data = fs::path(SHARED_DATA) / "redkitchen";
  if (!fs::exists(data)) GTEST_SKIP() << "no recording at " << data;
  fs::create_directories(folder_ / "scene");
  constexpr int kFrames = 20;
  for (int i = 0; i < kFrames; ++i) {
    char name[32];
    for (const char* part : {"color.jpg", "depth.png", "pose.txt"}) {
      std::snprintf(name, sizeof(name), "frame-%06d.%s", i, part);
      fs::create_symlink(fs::absolute(data) / name, folder_ / "scene" / name);
    }
  }
  import::SevenScenesOptions options;
  options.output = folder_ / "bag";
  open(import::import_seven_scenes(folder_ / "scene", options), options.output);
  FakeContext fake("sync");
  fake.set_parameter("depth_source", std::string("depth_image"));
  fake.set_parameter("encoding", std::string("yuv420"));
  fake.set_parameter("lockstep", true);
  configure_camera(fake);
  SyncComponent component(fake);
  play(fake,
       {{std::string(topics::kCompressedImage), "compressed_image"},
        {std::string(topics::kCameraInfo), "camera_info"},
        {std::string(topics::kRegisteredDepth), "depth"}},
       kFrames);
  const auto depths = fake.published<DepthImage>("depth_image");
  const auto images = fake.published<FrameImage>("frame_image");
  ASSERT_EQ(depths.size(), static_cast<std::size_t>(kFrames));
  ASSERT_EQ(images.size(), static_cast<std::size_t>(kFrames));
  for (std::size_t i = 0; i < depths.size(); ++i) {
    EXPECT_EQ(depths[i]->header().stamp_ns(), images[i]->header().stamp_ns());
    EXPECT_EQ(depths[i]->header().frame_id(), i + 1);
    std::size_t valid = 0;
    for (std::size_t p = 0; p < depths[i]->depth_m_count(); ++p) {
      valid += depths[i]->depth_m()[p] > 0.0F ? 1 : 0;
      EXPECT_EQ(depths[i]->depth_m()[p] > 0.0F, depths[i]->sigma_m()[p] > 0.0F);
    }
    EXPECT_GT(valid, depths[i]->depth_m_count() / 2);
  }
  EXPECT_EQ(fake.published<Progress>("progress").size(), static_cast<std::size_t>(kFrames));
}

}  // namespace
}  // namespace camvox
