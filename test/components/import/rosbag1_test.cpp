#include "camvox/import/rosbag1.hpp"

#include <random>

#include "camvox/interfaces/livox_ros_driver2.hpp"
#include "camvox/interfaces/nav_msgs.hpp"
#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/storage/qos_profile.hpp"
#include "imported_bag.hpp"
#include "ros1_bag_file.hpp"

namespace camvox::import {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

class Rosbag1 : public ::testing::Test {
 protected:
  Rosbag1() { options_.output = output_; }
  storage::Result<ImportReport> run(const std::string& bytes) {
    return import_rosbag1(folder_.write("ros1.bag", bytes), options_);
  }
  std::string error(const std::string& bytes) { return error_of(run(bytes), output_); }

  /// A bag with one message of a type, imported and read back.
  template <typename T>
  T converted(const std::string& type, const std::string& definition, const std::string& data) {
    Ros1BagFile bag;
    bag.connection(0, "/topic", type, definition);
    bag.message(0, 10, 20, data);
    fs::remove_all(output_);
    const auto report = run(bag.str());
    EXPECT_TRUE(report.ok()) << report.status().message();
    const auto found = ImportedBag(output_).messages<T>("/topic");
    EXPECT_EQ(found.at(0).log_time_ns, 10'000'000'020);
    return found.at(0).message;
  }

  TemporaryFolder folder_;
  fs::path output_ = folder_.path() / "bag";
  ImportOptions options_;
};

std::vector<double> numbers(std::size_t count, double first) {
  std::vector<double> values(count);
  for (std::size_t i = 0; i < count; ++i) values[i] = first + static_cast<double>(i);
  return values;
}

std::string imu_data(const std::string& frame) {
  return Ros1Bytes().header(5, 6, frame).f64s(numbers(4 + 9 + 3 + 9 + 3 + 9, 1.0)).str();
}

std::string imu_bag(const std::string& compression, int messages = 3) {
  Ros1BagFile bag(compression);
  bag.connection(4, "/imu", "sensor_msgs/Imu", ros1::kImu);
  for (int i = 0; i < messages; ++i) {
    bag.message(4, static_cast<std::uint32_t>(100 + i), 0, imu_data("imu_link"));
    if (i == 0) bag.end_chunk();
  }
  return bag.str();
}

TEST_F(Rosbag1, ReadsChunksOfAllKinds) {
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    fs::remove_all(output_);
    const auto report = run(imu_bag(compression));
    ASSERT_TRUE(report.ok()) << compression << ": " << report.status().message();
    EXPECT_TRUE(report->left_out.empty());
    const auto found = ImportedBag(output_).messages<sensor_msgs::msg::Imu>("/imu");
    ASSERT_EQ(found.size(), 3U);
    EXPECT_EQ(found[2].log_time_ns, 102'000'000'000);
    const auto& imu = found[2].message;
    EXPECT_EQ(stamp_ns(imu), 5'000'000'006);
    EXPECT_EQ(imu.header().frame_id(), "imu_link");
    EXPECT_EQ(imu.orientation().w(), 4.0);
    EXPECT_EQ(imu.angular_velocity().x(), 14.0);
    EXPECT_EQ(imu.linear_acceleration_covariance()[8], 37.0);
  }
}

// Frame names of all lengths: the numbers behind them fall on all alignments.
TEST_F(Rosbag1, AlignsBehindStrings) {
  for (std::size_t length = 0; length < 9; ++length) {
    const std::string frame(length, 'f');
    const auto imu =
        converted<sensor_msgs::msg::Imu>("sensor_msgs/Imu", ros1::kImu, imu_data(frame));
    EXPECT_EQ(imu.header().frame_id(), frame);
    EXPECT_EQ(imu.linear_acceleration().z(), 28.0);
  }
}

TEST_F(Rosbag1, ConvertsImages) {
  const auto image = converted<sensor_msgs::msg::Image>("sensor_msgs/Image",
                                                        ros1::kImage,
                                                        Ros1Bytes()
                                                            .header(1, 2, "camera")
                                                            .u32(1)
                                                            .u32(3)
                                                            .text("mono8")
                                                            .u8(0)
                                                            .u32(3)
                                                            .text("abc")
                                                            .str());
  EXPECT_EQ(image.width(), 3U);
  EXPECT_EQ(image.encoding(), "mono8");
  EXPECT_THAT(image.data(), ElementsAre('a', 'b', 'c'));
  const auto compressed = converted<sensor_msgs::msg::CompressedImage>(
      "sensor_msgs/CompressedImage",
      ros1::kCompressedImage,
      Ros1Bytes().header(1, 2, "camera").text("jpeg").text("xy").str());
  EXPECT_EQ(compressed.format(), "jpeg");
  EXPECT_THAT(compressed.data(), ElementsAre('x', 'y'));
}

TEST_F(Rosbag1, ConvertsCameraInfo) {
  for (const std::size_t distortion : {0U, 5U}) {
    auto bytes = Ros1Bytes().header(1, 2, "c").u32(480).u32(640).text("plumb_bob");
    bytes.u32(static_cast<std::uint32_t>(distortion)).f64s(numbers(distortion, 0.5));
    bytes.f64s(numbers(9, 1.0)).f64s(numbers(9, 10.0)).f64s(numbers(12, 20.0));
    bytes.u32(2).u32(3).u32(4).u32(5).u32(6).u32(7).u8(2);  // true, but not 1
    const auto info = converted<sensor_msgs::msg::CameraInfo>(
        "sensor_msgs/CameraInfo", ros1::kCameraInfo, bytes.str());
    EXPECT_EQ(info.d(), numbers(distortion, 0.5));
    EXPECT_EQ(info.k()[8], 9.0);
    EXPECT_EQ(info.p()[11], 31.0);
    EXPECT_EQ(info.roi().width(), 7U);
    EXPECT_TRUE(info.roi().do_rectify());
  }
}

TEST_F(Rosbag1, ConvertsCloudsFixesAndOdometry) {
  const auto cloud = converted<sensor_msgs::msg::PointCloud2>("sensor_msgs/PointCloud2",
                                                              ros1::kPointCloud2,
                                                              Ros1Bytes()
                                                                  .header(1, 2, "lidar")
                                                                  .u32(1)
                                                                  .u32(2)
                                                                  .u32(2)
                                                                  .text("x")
                                                                  .u32(0)
                                                                  .u8(7)
                                                                  .u32(1)
                                                                  .text("intensity")
                                                                  .u32(4)
                                                                  .u8(2)
                                                                  .u32(1)
                                                                  .u8(0)
                                                                  .u32(5)
                                                                  .u32(10)
                                                                  .text("0123456789")
                                                                  .u8(1)
                                                                  .str());
  EXPECT_EQ(cloud.fields().at(1).name(), "intensity");
  EXPECT_EQ(cloud.fields().at(1).count(), 1U);
  EXPECT_EQ(cloud.data().size(), 10U);
  EXPECT_TRUE(cloud.is_dense());
  const auto fix = converted<sensor_msgs::msg::NavSatFix>("sensor_msgs/NavSatFix",
                                                          ros1::kNavSatFix,
                                                          Ros1Bytes()
                                                              .header(1, 2, "gps")
                                                              .number(std::int8_t{-1})
                                                              .number(std::uint16_t{3})
                                                              .f64s(numbers(3 + 9, 40.0))
                                                              .u8(2)
                                                              .str());
  EXPECT_EQ(fix.status().status(), -1);
  EXPECT_EQ(fix.status().service(), 3);
  EXPECT_EQ(fix.altitude(), 42.0);
  EXPECT_EQ(fix.position_covariance_type(), 2);
  const auto odometry = converted<nav_msgs::msg::Odometry>(
      "nav_msgs/Odometry",
      ros1::kOdometry,
      Ros1Bytes().header(1, 2, "odom").text("base").f64s(numbers(7 + 36 + 6 + 36, 1.0)).str());
  EXPECT_EQ(odometry.child_frame_id(), "base");
  EXPECT_EQ(odometry.pose().pose().orientation().w(), 7.0);
  EXPECT_EQ(odometry.twist().twist().linear().x(), 44.0);
  EXPECT_EQ(odometry.twist().covariance()[35], 85.0);
}

TEST_F(Rosbag1, ConvertsLivoxPointsWithAndWithoutTag) {
  for (const bool tag : {true, false}) {
    auto bytes = Ros1Bytes().header(1, 2, "livox_frame").number(std::uint64_t{123456789012}).u32(2);
    bytes.u8(9).u8(1).u8(2).u8(3).u32(2);
    for (std::uint8_t i = 0; i < 2; ++i) {
      bytes.u32(100U + i).f32(1.5F).f32(2.5F).f32(3.5F).u8(200);
      if (tag) bytes.u8(0x10);
      bytes.u8(static_cast<std::uint8_t>(4 + i));
    }
    const auto message = converted<livox_ros_driver2::msg::CustomMsg>(
        "livox_ros_driver/CustomMsg", ros1::livox("livox_ros_driver", tag), bytes.str());
    EXPECT_EQ(message.timebase(), 123456789012U);
    EXPECT_EQ(message.lidar_id(), 9);
    EXPECT_EQ(message.rsvd()[2], 3);
    ASSERT_EQ(message.points().size(), 2U);
    EXPECT_EQ(message.points()[1].offset_time(), 101U);
    EXPECT_EQ(message.points()[1].z(), 3.5F);
    EXPECT_EQ(message.points()[1].reflectivity(), 200);
    EXPECT_EQ(message.points()[1].tag(), tag ? 0x10 : 0);
    EXPECT_EQ(message.points()[1].line(), 5);
  }
}

TEST_F(Rosbag1, ConvertsTransformsOfBothNames) {
  const auto data = Ros1Bytes().u32(1).header(1, 2, "map").text("odom").f64s(numbers(7, 1.0)).str();
  for (const std::string type : {"tf/tfMessage", "tf2_msgs/TFMessage"}) {
    const auto message = converted<tf2_msgs::msg::TFMessage>(type, ros1::kTransforms, data);
    EXPECT_EQ(message.transforms().at(0).child_frame_id(), "odom");
    EXPECT_EQ(message.transforms().at(0).transform().rotation().w(), 7.0);
  }
}

TEST_F(Rosbag1, SaysWhatIsLeftOutAndWhy) {
  Ros1BagFile bag;
  bag.connection(0, "/imu", "sensor_msgs/Imu", ros1::kImu);
  bag.connection(1, "/joy", "sensor_msgs/Joy", "Header header\nfloat32[] axes\n");
  bag.connection(
      2, "imu_raw", "sensor_msgs/Imu", "float64 x\n", Ros1BagFile::field("latching", "1"));
  bag.connection(3, "/imu", "sensor_msgs/Image", ros1::kImage);
  bag.message(0, 1, 0, imu_data("i"));
  bag.message(0, 1, 0, imu_data("i") + "x");
  for (int i = 0; i < 3; ++i) bag.message(1, 1, 0, "");
  bag.message(2, 1, 0, "12345678");
  bag.message(3, 1, 0, "");
  const auto report = run(bag.str());
  ASSERT_TRUE(report.ok()) << report.status().message();
  ASSERT_EQ(report->left_out.size(), 4U);
  EXPECT_EQ(report->left_out[0].why, "the messages do not fit their own definition");
  EXPECT_EQ(report->left_out[1].what, "/joy (sensor_msgs/Joy)");
  EXPECT_EQ(report->left_out[1].count, 3U);
  EXPECT_THAT(report->left_out[1].why, HasSubstr("no such type"));
  EXPECT_THAT(report->left_out[2].why, HasSubstr("has x in place of header"));
  EXPECT_THAT(report->left_out[3].why, HasSubstr("/imu carries sensor_msgs/msg/Imu"));
  EXPECT_THAT(ImportedBag(output_).counts(), ElementsAre(Pair("/imu", 1)));
}

TEST_F(Rosbag1, LatchedTopicsStayLatched) {
  Ros1BagFile bag;
  bag.connection(0, "map_info", "sensor_msgs/Imu", ros1::kImu, Ros1BagFile::field("latching", "1"));
  bag.message(0, 1, 0, imu_data("i"));
  ASSERT_TRUE(run(bag.str()).ok());
  const ImportedBag imported(output_);
  EXPECT_EQ(imported.reader().topics()[0].name, "/map_info");
  const auto qos = storage::parse_qos_profiles(imported.reader().topics()[0].offered_qos_profiles);
  EXPECT_EQ(qos->front().durability, storage::QosProfile::Durability::kTransientLocal);
}

TEST_F(Rosbag1, RefusesWhatIsNoBag) {
  EXPECT_THAT(error(""), HasSubstr("is no ROS 1 bag"));
  EXPECT_THAT(error("#ROSBAG V1.2\n and so on"), HasSubstr("is no ROS 1 bag"));
  EXPECT_THAT(error("#ROSBAG V2.0\n"), HasSubstr("nothing that can be imported"));
  EXPECT_THAT(error(imu_bag("rar")), HasSubstr("compressed with 'rar'"));
  auto bytes = imu_bag("bz2");
  bytes.replace(bytes.find("BZh"), 3, "xxx");
  EXPECT_THAT(error(bytes), HasSubstr("a bz2 chunk is broken"));
}

// Cut off anywhere: an error that names the file, or the messages of the chunks that are whole.
TEST_F(Rosbag1, SurvivesTruncationAtEveryByte) {
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    const auto whole = imu_bag(compression);
    for (std::size_t size = 0; size < whole.size(); size += 1) {
      const auto result = run(whole.substr(0, size));
      if (!result.ok()) {
        EXPECT_THAT(result.status().message(),
                    ::testing::AnyOf(HasSubstr("ros1.bag"), HasSubstr("nothing that can be")));
        EXPECT_FALSE(fs::exists(output_));
      }
      fs::remove_all(output_);
    }
  }
}

TEST_F(Rosbag1, SurvivesBitFlips) {
  std::mt19937 random(7);
  for (int i = 0; i < 3000; ++i) {
    auto bytes = imu_bag(i % 3 == 0 ? "none" : i % 3 == 1 ? "bz2" : "lz4", 2);
    for (int flips = 0; flips < 3; ++flips) {
      bytes[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
    }
    (void)run(bytes);  // no crash, no hang; most flips of numbers cannot be noticed
    fs::remove_all(output_);
  }
}

}  // namespace
}  // namespace camvox::import
