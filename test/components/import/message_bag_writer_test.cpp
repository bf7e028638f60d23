#include "camvox/import/message_bag_writer.hpp"

#include "camvox/interfaces/sensor_msgs.hpp"
#include "camvox/interfaces/tf2_msgs.hpp"
#include "camvox/storage/qos_profile.hpp"
#include "imported_bag.hpp"

namespace camvox::import {
namespace {

using ::testing::HasSubstr;

sensor_msgs::msg::Imu imu(int sec) {
  sensor_msgs::msg::Imu message;
  message.header().stamp().sec(sec);
  message.header().frame_id("imu_link");
  message.linear_acceleration().z(9.81);
  return message;
}

TEST(MessageBagWriter, WritesTypedMessagesWithSchemaHashAndQos) {
  const TemporaryFolder folder;
  auto writer = MessageBagWriter::create(folder.path() / "bag");
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->write("/imu/data", 2'000, imu(2)).ok());
  ASSERT_TRUE((*writer)->write("/imu/data", 3'000, imu(3)).ok());
  ASSERT_TRUE((*writer)->write("/tf_static", 3'000, tf2_msgs::msg::TFMessage()).ok());
  EXPECT_EQ((*writer)->topics()[0].message_count, 2U);
  EXPECT_EQ((*writer)->topics()[0].last_time_ns, 3'000);
  ASSERT_TRUE((*writer)->close().ok());

  const ImportedBag bag(folder.path() / "bag");
  const auto messages = bag.messages<sensor_msgs::msg::Imu>("/imu/data");
  ASSERT_EQ(messages.size(), 2U);
  EXPECT_EQ(messages[1].log_time_ns, 3'000);
  EXPECT_EQ(messages[1].message, imu(3));
  for (const auto& topic : bag.reader().topics()) {
    const auto qos = storage::parse_qos_profiles(topic.offered_qos_profiles);
    ASSERT_TRUE(qos.ok());
    const bool latched =
        qos->front().durability == storage::QosProfile::Durability::kTransientLocal;
    EXPECT_EQ(latched, topic.name == "/tf_static");
  }
}

TEST(MessageBagWriter, RefusesASecondTypeABadNameAndAnExistingFolder) {
  const TemporaryFolder folder;
  auto writer = MessageBagWriter::create(folder.path() / "bag");
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->write("/imu", 1, imu(1)).ok());
  const auto other = (*writer)->write("/imu", 2, sensor_msgs::msg::Image());
  EXPECT_EQ(other.code(), storage::StatusCode::kInvalid);
  EXPECT_THAT(other.message(), HasSubstr("carries sensor_msgs/msg/Imu"));
  EXPECT_EQ((*writer)->write("imu", 2, imu(2)).code(), storage::StatusCode::kInvalid);
  EXPECT_FALSE(MessageBagWriter::create(folder.path() / "bag").ok());
}

}  // namespace
}  // namespace camvox::import
