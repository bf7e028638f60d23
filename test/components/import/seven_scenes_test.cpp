#include "camvox/import/seven_scenes.hpp"

#include <Eigen/Geometry>
#include <cstring>

#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "imported_bag.hpp"
#include "png_file.hpp"

namespace camvox::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

const std::string kPose = "1 0 0 1.0\n0 0 -1 2.0\n0 1 0 3.0\n0 0 0 1\n";

class SevenScenes : public ::testing::Test {
 protected:
  /// Frames of 8x6 pixels, the depth camera twice as fine as the colour camera.
  SevenScenes() {
    options_.output = output_;
    options_.rig.depth = {8, 6, 8.0, 8.0, 4.0, 3.0};
    options_.rig.camera = {8, 6, 4.0, 4.0, 4.0, 3.0};
    for (const std::string name : {"frame-000000", "frame-000001", "frame-000003"}) {
      folder_.write("scene/" + name + ".pose.txt", kPose);
      write_grey_png(scene_ / (name + ".color.png"), 8, 6, grey_, 8);
      write_grey_png(scene_ / (name + ".depth.png"), 8, 6, depth_);
    }
  }
  storage::Result<ImportReport> run() { return import_seven_scenes(scene_, options_); }
  std::string error() { return error_of(run(), output_); }

  TemporaryFolder folder_;
  fs::path scene_ = folder_.path() / "scene";
  fs::path output_ = folder_.path() / "bag";
  std::vector<std::uint16_t> grey_ = std::vector<std::uint16_t>(48, 100);
  std::vector<std::uint16_t> depth_ = std::vector<std::uint16_t>(48, 0x0203);
  SevenScenesOptions options_;
};

TEST_F(SevenScenes, WritesStampedFramesAndReportsGaps) {
  folder_.write("scene/readme.txt", "hello");
  fs::remove(scene_ / "frame-000001.pose.txt");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing, ElementsAre("pose of 1 frames", "all files of 1 frames"));
  EXPECT_EQ(report->left_out.at(0).what, "readme.txt");
  const ImportedBag bag(output_);
  EXPECT_THAT(bag.counts(),
              ElementsAre(Pair("/camera/camera_info", 3),
                          Pair("/camera/depth_registered/image_raw", 3),
                          Pair("/camera/image_raw/compressed", 3),
                          Pair("/ground_truth/odometry", 2),
                          Pair("/tf_static", 1)));
  const auto images =
      bag.messages<sensor_msgs::msg::CompressedImage>("/camera/image_raw/compressed");
  EXPECT_EQ(stamp_ns(images[1].message), 33'333'333);
  EXPECT_EQ(stamp_ns(images[2].message), 100'000'000);
  EXPECT_EQ(images[2].message.format(), "png");
}

TEST_F(SevenScenes, RegistersDepthAndMovesThePoseWithIt) {
  options_.rig.p_camera_depth_m = {-0.5, 0.0, 0.0};
  ASSERT_TRUE(run().ok());
  const ImportedBag bag(output_);
  const auto depth = bag.messages<sensor_msgs::msg::Image>("/camera/depth_registered/image_raw");
  const auto& image = depth[0].message;
  EXPECT_EQ(image.encoding(), "16UC1");
  EXPECT_EQ(image.step(), 16U);
  std::vector<std::uint16_t> pixels(48);
  std::memcpy(pixels.data(), image.data().data(), 96);
  EXPECT_EQ(pixels, register_depth(options_.rig, depth_));
  EXPECT_NE(std::count(pixels.begin(), pixels.end(), 0x0203), 0);
  // The depth camera's pose as in the file; the colour camera is 0.5 m to its right, along the
  // first column of the rotation.
  const auto truth = bag.messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  const auto& position = truth[0].message.pose().pose().position();
  EXPECT_NEAR(position.x(), 1.5, 1e-12);
  EXPECT_NEAR(position.y(), 2.0, 1e-12);
  EXPECT_NEAR(position.z(), 3.0, 1e-12);
  EXPECT_NEAR(truth[0].message.pose().pose().orientation().x(), std::sqrt(0.5), 1e-12);
}

TEST_F(SevenScenes, RefusesBrokenFilesByName) {
  folder_.write("scene/frame-000001.pose.txt", "1 0 0 0\n0 1 0\n");
  EXPECT_THAT(error(), HasSubstr("frame-000001.pose.txt:2: expected 4 fields, found 3"));
  folder_.write("scene/frame-000001.pose.txt", "1 0 0 0\n0 nan 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(error(), HasSubstr("frame-000001.pose.txt:2: 'nan' is not a number"));
  folder_.write("scene/frame-000001.pose.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  EXPECT_THAT(error(), HasSubstr("frame-000001.pose.txt: is no pose"));
  folder_.write("scene/frame-000001.pose.txt", kPose);
  write_grey_png(scene_ / "frame-000001.depth.png", 8, 6, depth_, 8);
  EXPECT_THAT(error(), HasSubstr("frame-000001.depth.png: is not a 16-bit grey image"));
  write_grey_png(scene_ / "frame-000001.depth.png", 4, 12, depth_);
  EXPECT_THAT(error(), HasSubstr("frame-000001.depth.png: is 4x12, the camera has 8x6"));
}

TEST_F(SevenScenes, RefusesADepthImageCutOffAnywhere) {
  const auto path = scene_ / "frame-000003.depth.png";
  for (auto size = fs::file_size(path) - 1; size < fs::file_size(path); size -= 5) {
    fs::resize_file(path, size);
    EXPECT_THAT(error(), HasSubstr("frame-000003.depth.png")) << size;
    if (size < 5) break;
  }
}

TEST_F(SevenScenes, RefusesAFolderWithoutFrames) {
  fs::remove_all(scene_);
  EXPECT_THAT(error(), HasSubstr("is no folder"));
  fs::create_directories(scene_);
  EXPECT_THAT(error(), HasSubstr("nothing that can be imported"));
}

TEST(RedKitchen, IsImportedWhole) {
  const fs::path scene = fs::path(SHARED_DATA) / "redkitchen";
  if (!fs::exists(scene)) GTEST_SKIP() << "no recording at " << scene;
  const TemporaryFolder folder;
  SevenScenesOptions options;
  options.output = folder.path() / "bag";
  options.bag.mcap.compression = storage::Compression::kLz4;
  const auto report = import_seven_scenes(scene, options);
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing, ElementsAre());
  EXPECT_EQ(report->left_out.size(), 1U);  // camera-intrinsics.txt
  const ImportedBag bag(options.output);
  EXPECT_THAT(bag.counts(),
              ElementsAre(Pair("/camera/camera_info", 500),
                          Pair("/camera/depth_registered/image_raw", 500),
                          Pair("/camera/image_raw/compressed", 500),
                          Pair("/ground_truth/odometry", 500),
                          Pair("/tf_static", 1)));
  const auto truth = bag.messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  EXPECT_EQ(truth[499].log_time_ns, 16'633'333'333);
  // The first pose file, minus 2.5 cm along its x axis backwards: the colour camera is to the
  // right.
  const auto& position = truth[0].message.pose().pose().position();
  EXPECT_NEAR(position.x(), -3.404563400e-01 + 0.025 * 9.093129e-01, 1e-5);
  EXPECT_NEAR(position.y(), 1.646981800e-02 - 0.025 * 2.7248618e-01, 1e-5);
  EXPECT_NEAR(position.z(), 2.965691700e-01 + 0.025 * 3.1433925e-01, 1e-5);
  // Most of a Kinect's view has depth.
  const auto depth = bag.messages<sensor_msgs::msg::Image>("/camera/depth_registered/image_raw");
  const auto& data = depth[100].message.data();
  std::size_t seen = 0;
  for (std::size_t i = 0; i < data.size(); i += 2) seen += data[i] != 0 || data[i + 1] != 0 ? 1 : 0;
  EXPECT_GT(seen, 640 * 480 / 2);
}

}  // namespace
}  // namespace camvox::import
