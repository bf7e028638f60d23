#include "camvox/import/tum_rgbd.hpp"

#include <cstring>

#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "imported_bag.hpp"
#include "png_file.hpp"

// No sequence of the benchmark is at hand: small ones in its form are made here.
namespace camvox::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

class TumRgbd : public ::testing::Test {
 protected:
  TumRgbd() {
    options_.output = output_;
    fs::create_directories(scene_ / "rgb");
    fs::create_directories(scene_ / "depth");
    for (const std::string name : {"1305031102.175304.png", "1305031102.211214.png"}) {
      write_grey_png(scene_ / "rgb" / name, 4, 2, std::vector<std::uint16_t>(8, 9), 8);
    }
    write_grey_png(
        scene_ / "depth/1305031102.160407.png", 4, 2, {0, 5000, 5003, 2, 3, 65535, 50, 10000});
    write("rgb.txt",
          "# color images\n1305031102.175304 rgb/1305031102.175304.png\n"
          "1305031102.211214 rgb/1305031102.211214.png\n");
    write("depth.txt", "# depth maps\n1305031102.160407 depth/1305031102.160407.png\n");
    write("groundtruth.txt",
          "# timestamp tx ty tz qx qy qz qw\n1305031098.6659 1 2 3 0 0 0.6 0.8\n");
    write("accelerometer.txt", "#time ax ay az\n1305031098.6 0.5 8.0 -4.0\n");
  }
  void write(const std::string& name, const std::string& text) {
    folder_.write("rgbd_dataset_freiburg1_xyz/" + name, text);
  }
  storage::Result<ImportReport> run() { return import_tum_rgbd(scene_, options_); }
  std::string error() { return error_of(run(), output_); }

  TemporaryFolder folder_;
  fs::path scene_ = folder_.path() / "rgbd_dataset_freiburg1_xyz";
  fs::path output_ = folder_.path() / "bag";
  TumRgbdOptions options_;
};

TEST_F(TumRgbd, ImportsAllLists) {
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_TRUE(report->missing.empty());
  EXPECT_TRUE(report->left_out.empty());
  const ImportedBag bag(output_);
  EXPECT_THAT(bag.counts(),
              ElementsAre(Pair("/camera/camera_info", 2),
                          Pair("/camera/depth_registered/image_raw", 1),
                          Pair("/camera/image_raw/compressed", 2),
                          Pair("/ground_truth/odometry", 1),
                          Pair("/imu/data_raw", 1),
                          Pair("/tf_static", 1)));
  const auto infos = bag.messages<sensor_msgs::msg::CameraInfo>("/camera/camera_info");
  EXPECT_EQ(stamp_ns(infos[0].message), 1'305'031'102'175'304'000);  // to the nanosecond
  EXPECT_THAT(infos[0].message.d(), ElementsAre(0.2624, -0.9531, -0.0054, 0.0026, 1.1633));
  EXPECT_EQ(infos[0].message.k()[4], 516.5);
  EXPECT_EQ(infos[0].message.width(), 4U);
}

TEST_F(TumRgbd, DepthIsMillimetres) {
  ASSERT_TRUE(run().ok());
  const auto depth =
      ImportedBag(output_).messages<sensor_msgs::msg::Image>("/camera/depth_registered/image_raw");
  const auto& image = depth[0].message;
  EXPECT_EQ(image.encoding(), "16UC1");
  std::vector<std::uint16_t> pixels(8);
  ASSERT_EQ(image.data().size(), 16U);
  std::memcpy(pixels.data(), image.data().data(), 16);
  EXPECT_THAT(pixels, ElementsAre(0, 1000, 1001, 0, 1, 13107, 10, 2000));
}

TEST_F(TumRgbd, PosesAndAcceleration) {
  ASSERT_TRUE(run().ok());
  const ImportedBag bag(output_);
  const auto truth = bag.messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  EXPECT_EQ(stamp_ns(truth[0].message), 1'305'031'098'665'900'000);
  EXPECT_EQ(truth[0].message.child_frame_id(), "camera_optical_frame");
  const auto& pose = truth[0].message.pose().pose();
  EXPECT_EQ(pose.position().y(), 2.0);
  EXPECT_NEAR(pose.orientation().z(), 0.6, 1e-12);
  EXPECT_NEAR(pose.orientation().w(), 0.8, 1e-12);
  const auto imu = bag.messages<sensor_msgs::msg::Imu>("/imu/data_raw");
  EXPECT_EQ(imu[0].message.linear_acceleration().y(), 8.0);
  EXPECT_EQ(imu[0].message.orientation_covariance()[0], -1.0);
  EXPECT_EQ(imu[0].message.angular_velocity_covariance()[0], -1.0);
}

TEST_F(TumRgbd, SaysWhatIsMissingAndLeftOut) {
  fs::remove(scene_ / "rgb/1305031102.211214.png");
  fs::remove(scene_ / "groundtruth.txt");
  fs::remove(scene_ / "accelerometer.txt");
  write("notes.txt", "mine");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_THAT(report->missing,
              ElementsAre("rgb.txt: 1 of its files", "groundtruth.txt", "accelerometer.txt"));
  EXPECT_EQ(report->left_out.at(0).what, "notes.txt");
}

TEST_F(TumRgbd, ReadsIclNuim) {
  for (const auto* name : {"rgb.txt", "depth.txt", "groundtruth.txt", "accelerometer.txt"}) {
    fs::remove(scene_ / name);
  }
  fs::rename(scene_ / "rgb/1305031102.175304.png", scene_ / "rgb/3.png");
  fs::rename(scene_ / "depth/1305031102.160407.png", scene_ / "depth/3.png");
  write("associations.txt", "3 depth/3.png 3 rgb/3.png\n");
  write("livingRoom0.gt.freiburg", "3 1 2 3 0 0 0 1\n");
  options_.intrinsics = tum_intrinsics("icl");
  const auto report = run();
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_TRUE(report->missing.empty());
  const ImportedBag bag(output_);
  const auto truth = bag.messages<nav_msgs::msg::Odometry>("/ground_truth/odometry");
  EXPECT_EQ(stamp_ns(truth[0].message), 100'000'000);
  const auto infos = bag.messages<sensor_msgs::msg::CameraInfo>("/camera/camera_info");
  EXPECT_EQ(stamp_ns(infos[0].message), 100'000'000);
  EXPECT_EQ(infos[0].message.k()[0], 481.2);
}

TEST_F(TumRgbd, NamesFileAndLineOfWhatIsBroken) {
  write("groundtruth.txt", "#\n1.0 1 2 3 0 0 0 1\n1.1 1 2 3 0 0 1 1\n");
  EXPECT_THAT(error(), HasSubstr("groundtruth.txt:3: the quaternion is not of length 1"));
  write("groundtruth.txt", "1.0 1 2 3 0 0 0\n");
  EXPECT_THAT(error(), HasSubstr("groundtruth.txt:1: expected 8 fields, found 7"));
  write("groundtruth.txt", "-1.0 1 2 3 0 0 0 1\n");
  EXPECT_THAT(error(), HasSubstr("groundtruth.txt:1: the time is out of range"));
  write("groundtruth.txt", "");
  write("depth.txt", "1.0 rgb/1305031102.175304.png\n");
  EXPECT_THAT(error(), HasSubstr("1305031102.175304.png: is not a 16-bit grey image"));
  write("rgb.txt", "1.0\n");
  EXPECT_THAT(error(), HasSubstr("rgb.txt:1: expected 'timestamp filename'"));
}

TEST(TumIntrinsics, AreChosenByName) {
  EXPECT_EQ(tum_intrinsics("rgbd_dataset_freiburg3_long_office_household")->at(0), 535.4);
  EXPECT_EQ(tum_intrinsics("fr2")->at(0), 520.9);
  EXPECT_EQ(tum_intrinsics("living_room_traj0_frei_png")->at(1), -480.0);
  EXPECT_FALSE(tum_intrinsics("my_kinect"));
}

}  // namespace
}  // namespace camvox::import
