// The bags of the reference implementation, Debian's python3-rosbag.
#include <cstdlib>

#include "camvox/import/rosbag1.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "imported_bag.hpp"

namespace camvox::import {
namespace {

constexpr std::size_t kCount = 40;

std::vector<std::uint8_t> bytes(std::size_t first, std::size_t count) {
  std::vector<std::uint8_t> values(count);
  for (std::size_t k = 0; k < count; ++k) values[k] = static_cast<std::uint8_t>(first + k);
  return values;
}

/// The header and the log time of message i.
template <typename T>
void expect_stamped(const Logged<T>& logged, std::size_t i) {
  EXPECT_EQ(logged.log_time_ns, static_cast<std::int64_t>(1'600'000'100 + i) * 1'000'000'000 + 5);
  const auto& header = logged.message.header();
  EXPECT_EQ(static_cast<std::size_t>(header.stamp().sec()), 1'600'000'000 + i);
  EXPECT_EQ(header.stamp().nanosec(), 1000 * i);
  EXPECT_EQ(header.frame_id(), "frame_" + std::to_string(i));
}

/// All messages of a topic, with what they have in common checked.
template <typename T>
std::vector<Logged<T>> stamped(const ImportedBag& bag, const std::string& topic) {
  auto messages = bag.messages<T>(topic);
  EXPECT_EQ(messages.size(), kCount) << topic;
  for (std::size_t i = 0; i < messages.size(); ++i) expect_stamped(messages[i], i);
  return messages;
}

class Rosbag1Reference : public ::testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::system("/usr/bin/python3 -c 'import rosbag, sensor_msgs.msg' 2>/dev/null") != 0) {
      GTEST_SKIP() << "no python3-rosbag and python3-sensor-msgs on this machine";
    }
  }
};

TEST_P(Rosbag1Reference, EveryFieldArrives) {
  const TemporaryFolder folder;
  const auto file = (folder.path() / "ros1.bag").string();
  const std::string command =
      std::string("/usr/bin/python3 " WRITE_ROS1_BAG " ") + file + " " + GetParam();
  ASSERT_EQ(std::system(command.c_str()), 0);
  ImportOptions options;
  options.output = folder.path() / "bag";
  const auto report = import_rosbag1(file, options);
  ASSERT_TRUE(report.ok()) << report.status().message();
  EXPECT_TRUE(report->left_out.empty());
  const ImportedBag bag(options.output);
  const auto real = [](std::size_t i) { return static_cast<double>(i); };

  for (const auto& [log_time_ns, imu] : stamped<sensor_msgs::msg::Imu>(bag, "/imu")) {
    const auto i = static_cast<std::size_t>(imu.header().stamp().sec() - 1'600'000'000);
    EXPECT_EQ(imu.orientation().w(), 1.0 / real(i + 1));
    EXPECT_EQ(imu.angular_velocity().x(), real(i) / 7);
    EXPECT_EQ(imu.angular_velocity().y(), real(i) / 11);
    EXPECT_EQ(imu.angular_velocity().z(), real(i) / 13);
    EXPECT_EQ(imu.linear_acceleration().z(), 9.81 + real(i));
    EXPECT_EQ(imu.linear_acceleration_covariance()[8], real(i + 8));
  }
  const auto images = stamped<sensor_msgs::msg::Image>(bag, "/image");
  const auto files = stamped<sensor_msgs::msg::CompressedImage>(bag, "/image/compressed");
  const auto infos = stamped<sensor_msgs::msg::CameraInfo>(bag, "/info");
  const auto fixes = stamped<sensor_msgs::msg::NavSatFix>(bag, "/fix");
  const auto clouds = stamped<sensor_msgs::msg::PointCloud2>(bag, "/cloud");
  for (std::size_t i = 0; i < kCount; ++i) {
    EXPECT_EQ(images.at(i).message.encoding(), "rgb8");
    EXPECT_EQ(images.at(i).message.step(), 24U);
    EXPECT_EQ(images.at(i).message.data(), bytes(i, 96));
    EXPECT_EQ(files.at(i).message.format(), "jpeg");
    EXPECT_EQ(files.at(i).message.data(), bytes(3 * i, 50 + i));
    EXPECT_EQ(infos.at(i).message.width(), 640 + i);
    EXPECT_EQ(infos.at(i).message.d().at(0), 0.1 * real(i));
    EXPECT_EQ(infos.at(i).message.k()[8], real(i + 8));
    EXPECT_EQ(fixes.at(i).message.latitude(), 22.5 + real(i) / 1e6);
    EXPECT_EQ(fixes.at(i).message.altitude(), 40.0 + real(i));
    EXPECT_EQ(fixes.at(i).message.status().status(), 2);
    EXPECT_EQ(clouds.at(i).message.width(), i);
    EXPECT_EQ(clouds.at(i).message.data(), bytes(5 * i, 4 * i));
    EXPECT_EQ(clouds.at(i).message.fields().at(0).name(), "x");
  }
}

INSTANTIATE_TEST_SUITE_P(Compressions,
                         Rosbag1Reference,
                         ::testing::Values("none", "bz2", "lz4"),
                         [](const auto& compression) { return std::string(compression.param); });

}  // namespace
}  // namespace camvox::import
