#include <gmock/gmock.h>

#include <cstring>
#include <memory>
#include <random>

#include "camvox/interfaces/sensor_msgs.hpp"

namespace camvox::interfaces {
namespace {

using sensor_msgs::msg::Imu;
using sensor_msgs::msg::PointCloud2;
using sensor_msgs::msg::PointField;
using ::testing::ElementsAreArray;
using Bytes = std::vector<std::uint8_t>;

bool reads(const MessageType& type, const Bytes& cdr, void* message) {
  const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[cdr.size()]);
  std::copy(cdr.begin(), cdr.end(), exact.get());
  return type.read_cdr(exact.get(), cdr.size(), message);
}

PointCloud2 example_cloud() {
  PointCloud2 cloud;
  cloud.header().frame_id() = "livox_frame";
  cloud.width() = 3;
  cloud.point_step() = 12;
  for (const auto* name : {"x", "y", "z"}) {
    PointField field;
    field.name() = name;
    field.datatype() = 7;
    cloud.fields().push_back(field);
  }
  cloud.data().assign(36, 0x5A);
  cloud.is_dense() = true;
  return cloud;
}

TEST(RosCdr, ImuHasTheKnownBytes) {
  Imu imu;
  imu.header().stamp().sec() = 1600000000;
  imu.header().stamp().nanosec() = 123;
  imu.header().frame_id() = "livox_frame";
  const Bytes cdr = message_type<Imu>().to_cdr(&imu);
  EXPECT_EQ(cdr.size(), 324U);
  const Bytes start = {0, 1, 0, 0, 0x00, 0x10, 0x5e, 0x5f, 0x7b, 0, 0, 0, 12, 0, 0, 0, 'l', 'i'};
  EXPECT_THAT(Bytes(cdr.begin(), cdr.begin() + 18), ElementsAreArray(start));
}

TEST(RosCdr, RoundTripsACloud) {
  const auto& type = message_type<PointCloud2>();
  const PointCloud2 cloud = example_cloud();
  const Bytes cdr = type.to_cdr(&cloud);
  EXPECT_EQ(cdr.size(), type.cdr_size(&cloud));
  PointCloud2 copy;
  ASSERT_TRUE(reads(type, cdr, &copy));
  EXPECT_EQ(copy, cloud);
}

TEST(RosCdr, DefaultsAreThoseOfRos2) {
  for (const MessageType* type : all_message_types()) {
    const AnyMessage message = make_message(*type);
    const Bytes before = type->to_cdr(message.get());
    type->reset(message.get());
    EXPECT_EQ(type->to_cdr(message.get()), before) << type->ros_name;
    EXPECT_EQ(before.size(), type->cdr_size(message.get())) << type->ros_name;
  }
}

TEST(RosCdr, RefusesEveryTruncation) {
  const PointCloud2 cloud = example_cloud();
  const Bytes cdr = message_type<PointCloud2>().to_cdr(&cloud);
  for (std::size_t size = 0; size < cdr.size(); ++size) {
    PointCloud2 target;
    const Bytes cut(cdr.begin(), cdr.begin() + static_cast<long>(size));
    EXPECT_FALSE(reads(message_type<PointCloud2>(), cut, &target)) << size;
  }
}

TEST(RosCdr, RefusesEveryTruncationOfEveryType) {
  for (const MessageType* type : all_message_types()) {
    if (type->plain) continue;
    const AnyMessage message = make_message(*type);
    const Bytes cdr = type->to_cdr(message.get());
    for (std::size_t size = 0; size < cdr.size(); ++size) {
      const Bytes cut(cdr.begin(), cdr.begin() + static_cast<long>(size));
      EXPECT_FALSE(reads(*type, cut, message.get())) << type->ros_name << " " << size;
    }
  }
}

TEST(RosCdr, RefusesWrongEncapsulation) {
  const PointCloud2 cloud = example_cloud();
  Bytes cdr = message_type<PointCloud2>().to_cdr(&cloud);
  PointCloud2 target;
  for (const auto& [first, second] : {std::pair{0, 2}, {0, 3}, {0, 6}, {0, 7}, {1, 1}, {255, 1}}) {
    cdr[0] = static_cast<std::uint8_t>(first);
    cdr[1] = static_cast<std::uint8_t>(second);
    EXPECT_FALSE(reads(message_type<PointCloud2>(), cdr, &target)) << first << " " << second;
  }
}

TEST(RosCdr, RefusesAbsurdLengths) {
  const PointCloud2 cloud = example_cloud();
  const Bytes good = message_type<PointCloud2>().to_cdr(&cloud);
  const std::size_t frame_length = 12, fields_length = 36, data_length = good.size() - 1 - 36 - 4;
  for (const std::size_t place : {frame_length, fields_length, data_length}) {
    for (const std::uint32_t length : {1000U, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFFU}) {
      Bytes cdr = good;
      std::memcpy(cdr.data() + place, &length, sizeof(length));
      PointCloud2 target;
      EXPECT_FALSE(reads(message_type<PointCloud2>(), cdr, &target)) << place << " " << length;
    }
  }
}

TEST(RosCdr, SurvivesRandomDamage) {
  std::mt19937 random(1);
  const PointCloud2 cloud = example_cloud();
  const Bytes good = message_type<PointCloud2>().to_cdr(&cloud);
  int refused = 0;
  for (int round = 0; round < 5000; ++round) {
    Bytes cdr = good;
    const std::size_t place = random() % cdr.size();
    for (std::size_t i = place; i < std::min(place + 4, cdr.size()); ++i) {
      cdr[i] = static_cast<std::uint8_t>(random());
    }
    PointCloud2 target;
    refused += reads(message_type<PointCloud2>(), cdr, &target) ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

TEST(RosCdr, WritesTheSameBytesIntoADirtyBuffer) {
  const PointCloud2 cloud = example_cloud();
  const auto& type = message_type<PointCloud2>();
  const Bytes clean = type.to_cdr(&cloud);
  Bytes dirty(clean.size(), 0xA5);
  ASSERT_EQ(type.write_cdr(&cloud, dirty.data(), dirty.size()), clean.size());
  EXPECT_EQ(dirty, clean);
}

TEST(RosCdr, ReadsBigEndianToo) {
  Bytes cdr = {0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2, 0, 0, 0, 2, 'a', 0};
  std_msgs::msg::Header header;
  ASSERT_TRUE(reads(message_type<std_msgs::msg::Header>(), cdr, &header));
  EXPECT_EQ(header.stamp().sec(), 1);
  EXPECT_EQ(header.frame_id(), "a");
}

TEST(RosCdr, WriteRefusesShortBuffers) {
  const PointCloud2 cloud = example_cloud();
  const auto& type = message_type<PointCloud2>();
  const std::size_t needed = type.cdr_size(&cloud);
  for (std::size_t size = 0; size < needed; ++size) {
    const std::unique_ptr<std::uint8_t[]> exact(new std::uint8_t[size]);
    EXPECT_EQ(type.write_cdr(&cloud, exact.get(), size), 0U) << size;
  }
}

}  // namespace
}  // namespace camvox::interfaces
