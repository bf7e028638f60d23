#include "camvox/sync_component/lidar_input.hpp"

#include <gmock/gmock.h>

#include <cstring>
#include <limits>

#include "sensor_streams.hpp"

namespace camvox::sync_component {
namespace {

using sensor_msgs::msg::PointCloud2;
using test::kMs;
using test::kStart_ns;

std::string read(const livox_ros_driver2::msg::CustomMsg& message, sync::LidarChunk& chunk) {
  return read_livox(message, {}, chunk);
}

TEST(ReadLivox, TakesTimesFromTheTimebase) {
  sync::LidarChunk chunk;
  auto message = test::livox_message(kStart_ns, 10 * kMs);
  test::set_stamp(message, kStart_ns + 3 * kMs);  // when the driver sent it
  ASSERT_EQ(read(message, chunk), "");
  EXPECT_EQ(chunk.stamp_ns, kStart_ns);
  EXPECT_EQ(chunk.end_ns, kStart_ns + 9 * kMs);
  ASSERT_EQ(chunk.returns.size(), 10U);
  EXPECT_EQ(chunk.returns[4].offset_ns, 4 * kMs);
  EXPECT_FLOAT_EQ(chunk.returns[4].x_m, 1004.0F);
  EXPECT_FLOAT_EQ(chunk.returns[4].reflectivity, 50.0F);
  EXPECT_EQ(chunk.returns[4].line, 3);
}

TEST(ReadLivox, TakesTheHeadersClockWhenTheLidarsIsNotSynchronised) {
  sync::LidarChunk chunk;
  auto message = test::livox_message(kStart_ns, 10 * kMs);
  message.timebase(1234567890);  // since the lidar was switched on
  ASSERT_EQ(read(message, chunk), "");
  EXPECT_EQ(chunk.stamp_ns, kStart_ns);
}

TEST(ReadLivox, DropsEmptyNoisyAndBrokenReturnsButKeepsTheirTime) {
  auto message = test::livox_message(kStart_ns, 6 * kMs);
  auto& points = message.points();
  points[0].tag(0x10);  // a second echo: no noise
  points[1].tag(0x02);  // moderate, by position
  points[2].tag(0x0c);  // low, by intensity
  points[3].x(std::numeric_limits<float>::quiet_NaN());
  points[5].x(0.0F);
  points[5].y(0.0F);
  points[5].z(0.0F);
  sync::LidarChunk chunk;
  ASSERT_EQ(read(message, chunk), "");
  ASSERT_EQ(chunk.returns.size(), 3U);
  EXPECT_EQ(chunk.returns[1].offset_ns, 2 * kMs);
  EXPECT_EQ(chunk.end_ns, kStart_ns + 5 * kMs);
  LidarInputOptions all;
  all.noise = lidar::NoiseConfidence::kKeepAll;
  ASSERT_EQ(read_livox(message, all, chunk), "");
  EXPECT_EQ(chunk.returns.size(), 4U);
}

TEST(ReadLivox, EmptyMessageIsNoError) {
  sync::LidarChunk chunk;
  EXPECT_EQ(read(test::livox_message(kStart_ns, 0), chunk), "");
  EXPECT_TRUE(chunk.returns.empty());
}

/// A cloud with x y z as float32 and one more field, whose bytes `write(i)` gives.
template <typename T, typename Value>
PointCloud2 cloud_with(const std::string& name, std::uint8_t datatype, Value value) {
  PointCloud2 cloud;
  test::set_stamp(cloud, kStart_ns);
  const auto add_field =
      [&](const std::string& field_name, std::uint32_t offset, std::uint8_t type) {
        sensor_msgs::msg::PointField field;
        field.name(field_name);
        field.offset(offset);
        field.datatype(type);
        field.count(1);
        cloud.fields().push_back(field);
      };
  add_field("x", 0, 7);
  add_field("y", 4, 7);
  add_field("z", 8, 7);
  add_field(name, 12, datatype);
  constexpr std::uint32_t kPoints = 5;
  cloud.width(kPoints);
  cloud.height(1);
  cloud.point_step(12 + sizeof(T));
  cloud.row_step(kPoints * cloud.point_step());
  cloud.data().resize(cloud.row_step());
  for (std::uint32_t i = 0; i < kPoints; ++i) {
    auto* point = cloud.data().data() + i * cloud.point_step();
    const float xyz[3] = {static_cast<float>(i), 1.0F, 2.0F};
    const T extra = value(i);
    std::memcpy(point, xyz, sizeof(xyz));
    std::memcpy(point + 12, &extra, sizeof(T));
  }
  return cloud;
}

/// Times of all points after kStart_ns, ms.
std::vector<double> times_ms(const PointCloud2& cloud, const LidarInputOptions& options = {}) {
  sync::LidarChunk chunk;
  EXPECT_EQ(read_point_cloud(cloud, options, chunk), "");
  std::vector<double> times;
  for (const auto& point : chunk.returns) {
    times.push_back(1e-6 * static_cast<double>(chunk.stamp_ns + point.offset_ns - kStart_ns));
  }
  return times;
}

const auto kExpected = ::testing::ElementsAre(::testing::DoubleNear(0.0, 1e-3),
                                              ::testing::DoubleNear(10.0, 1e-3),
                                              ::testing::DoubleNear(20.0, 1e-3),
                                              ::testing::DoubleNear(30.0, 1e-3),
                                              ::testing::DoubleNear(40.0, 1e-3));

TEST(ReadPointCloud, KnowsTheTimeFieldsOfTheUsualDrivers) {
  const auto ns = [](std::uint32_t i) { return static_cast<std::uint32_t>(i * 10 * kMs); };
  EXPECT_THAT(times_ms(cloud_with<std::uint32_t>("t", 6, ns)), kExpected);            // Ouster
  EXPECT_THAT(times_ms(cloud_with<std::uint32_t>("offset_time", 6, ns)), kExpected);  // Livox
  const auto s = [](std::uint32_t i) { return 0.01F * static_cast<float>(i); };
  EXPECT_THAT(times_ms(cloud_with<float>("time", 7, s)), kExpected);  // Velodyne, KITTI
  const auto epoch_s = [](std::uint32_t i) {
    return 1e-9 * static_cast<double>(kStart_ns) + 0.01 * i;
  };
  EXPECT_THAT(times_ms(cloud_with<double>("timestamp", 8, epoch_s)),
              kExpected);  // Hesai, RoboSense
  const auto epoch_ns = [](std::uint32_t i) {
    return static_cast<double>(kStart_ns + 10 * kMs * i);
  };
  EXPECT_THAT(times_ms(cloud_with<double>("timestamp", 8, epoch_ns)), kExpected);  // Livox driver 2
}

TEST(ReadPointCloud, UnitCanBeGiven) {
  LidarInputOptions options;
  options.point_time_unit = "us";
  const auto us = [](std::uint32_t i) { return static_cast<std::uint32_t>(i * 10'000); };
  EXPECT_THAT(times_ms(cloud_with<std::uint32_t>("t", 6, us), options), kExpected);
}

TEST(ReadPointCloud, AllowsTimesBeforeTheStamp) {
  const auto s = [](std::uint32_t i) { return -0.01F * static_cast<float>(i); };
  sync::LidarChunk chunk;
  ASSERT_EQ(read_point_cloud(cloud_with<float>("time", 7, s), {}, chunk), "");
  EXPECT_NEAR(static_cast<double>(kStart_ns - chunk.stamp_ns), 40.0 * kMs, 100.0);
  EXPECT_NEAR(chunk.returns[0].offset_ns, 40.0 * kMs, 100.0);
  EXPECT_EQ(chunk.returns[4].offset_ns, 0U);
}

TEST(ReadPointCloud, SaysWhenThereAreNoTimes) {
  sync::LidarChunk chunk;
  const auto value = [](std::uint32_t i) { return static_cast<float>(100 * i); };
  ASSERT_EQ(read_point_cloud(cloud_with<float>("intensity", 7, value), {}, chunk), "");
  EXPECT_FALSE(chunk.has_point_times);
  EXPECT_EQ(chunk.stamp_ns, kStart_ns);
  EXPECT_FLOAT_EQ(chunk.returns[2].reflectivity, 200.0F);
  EXPECT_FLOAT_EQ(chunk.returns[4].reflectivity, 255.0F);
}

TEST(ReadPointCloud, RefusesWhatItCannotRead) {
  sync::LidarChunk chunk;
  const auto zero = [](std::uint32_t) { return 0.0F; };
  auto cut_off = cloud_with<float>("time", 7, zero);
  cut_off.data().resize(cut_off.data().size() - 1);
  EXPECT_NE(read_point_cloud(cut_off, {}, chunk), "");
  auto nameless = cloud_with<float>("time", 7, zero);
  nameless.fields()[0].name("a");
  EXPECT_NE(read_point_cloud(nameless, {}, chunk), "");
  auto outside = cloud_with<float>("time", 7, zero);
  outside.fields()[2].offset(1000);
  EXPECT_NE(read_point_cloud(outside, {}, chunk), "");
  const auto nan = [](std::uint32_t) { return std::numeric_limits<float>::quiet_NaN(); };
  EXPECT_NE(read_point_cloud(cloud_with<float>("time", 7, nan), {}, chunk), "");
  const auto hours = [](std::uint32_t i) { return 3600.0F * static_cast<float>(i); };
  EXPECT_NE(read_point_cloud(cloud_with<float>("time", 7, hours), {}, chunk), "");
}

TEST(ReadPointCloud, EmptyCloudIsNoError) {
  auto cloud = cloud_with<float>("time", 7, [](std::uint32_t) { return 0.0F; });
  cloud.width(0);
  cloud.row_step(0);
  cloud.data().clear();
  sync::LidarChunk chunk;
  EXPECT_EQ(read_point_cloud(cloud, {}, chunk), "");
  EXPECT_TRUE(chunk.returns.empty());
}

}  // namespace
}  // namespace camvox::sync_component
