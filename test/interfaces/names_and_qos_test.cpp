#include <gmock/gmock.h>

#include <string>

#include "camvox/interfaces/message_type.hpp"
#include "camvox/interfaces/qos.hpp"
#include "camvox/interfaces/topics.hpp"

namespace camvox::interfaces {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(TopicName, AcceptsWhatRos2Accepts) {
  for (const auto* name : {"/a", "/camera/image_raw", "/tf_static", "/_hidden", "/a/B2/c_3"}) {
    EXPECT_THAT(topics::name_problem(name), IsEmpty()) << name;
  }
  EXPECT_THAT(topics::name_problem("/" + std::string(249, 'a')), IsEmpty());
}

TEST(TopicName, SaysWhichRuleIsBroken) {
  EXPECT_THAT(topics::name_problem(""), HasSubstr("start with '/'"));
  EXPECT_THAT(topics::name_problem("camera"), HasSubstr("'camera' must start with '/'"));
  EXPECT_THAT(topics::name_problem("/camera/"), HasSubstr("end with '/'"));
  EXPECT_THAT(topics::name_problem("/"), HasSubstr("end with '/'"));
  EXPECT_THAT(topics::name_problem("/a//b"), HasSubstr("empty part"));
  EXPECT_THAT(topics::name_problem("/a/2b"), HasSubstr("starts with a digit"));
  EXPECT_THAT(topics::name_problem("/a b"), HasSubstr("only letters"));
  EXPECT_THAT(topics::name_problem("/~a"), HasSubstr("only letters"));
  EXPECT_THAT(topics::name_problem("/caf\xc3\xa9"), HasSubstr("only letters"));
  EXPECT_THAT(topics::name_problem("/" + std::string(250, 'a')), HasSubstr("250"));
}

TEST(TopicName, AllOfOursAreValid) {
  for (const auto name : {topics::kImage,
                          topics::kCompressedImage,
                          topics::kCameraInfo,
                          topics::kLidar,
                          topics::kImu,
                          topics::kGnss,
                          topics::kClock,
                          topics::kOdometry,
                          topics::kPath,
                          topics::kTransforms,
                          topics::kStaticTransforms,
                          topics::kDiagnostics,
                          topics::kFrameImage,
                          topics::kScan,
                          topics::kCloud,
                          topics::kDepthImage,
                          topics::kFramePose,
                          topics::kKeyframe,
                          topics::kLocalMap,
                          topics::kMapUpdate,
                          topics::kLoopCorrection,
                          topics::kRelocalisationRequest,
                          topics::kRelocalisationAnswer,
                          topics::kExtrinsics,
                          topics::kProgress}) {
    EXPECT_THAT(topics::name_problem(name), IsEmpty());
  }
}

TEST(TypeName, ConvertsBetweenRosAndDds) {
  EXPECT_EQ(to_dds_type_name("sensor_msgs/msg/Imu"), "sensor_msgs::msg::dds_::Imu_");
  EXPECT_EQ(to_dds_type_name("rcl_interfaces/srv/GetParameters_Request"),
            "rcl_interfaces::srv::dds_::GetParameters_Request_");
  EXPECT_EQ(to_ros_type_name("sensor_msgs::msg::dds_::Imu_"), "sensor_msgs/msg/Imu");
  EXPECT_EQ(to_ros_type_name("Foreign::Type"), "Foreign::Type");
  EXPECT_EQ(to_ros_type_name("a::dds_::NoUnderscore"), "a::dds_::NoUnderscore");
  for (const MessageType* type : all_message_types()) {
    EXPECT_EQ(to_ros_type_name(type->dds_name), type->ros_name);
    EXPECT_EQ(find_message_type(type->dds_name), type);
    EXPECT_EQ(find_message_type(type->ros_name), type);
  }
  EXPECT_EQ(find_message_type("sensor_msgs/msg/Nothing"), nullptr);
}

TEST(TypeName, RenamedTypeKeepsItsCodec) {
  const MessageType* ours = find_message_type("livox_ros_driver2/msg/CustomMsg");
  ASSERT_NE(ours, nullptr);
  const MessageType theirs = renamed(*ours, "livox_interfaces/msg/CustomMsg");
  EXPECT_EQ(theirs.dds_name, "livox_interfaces::msg::dds_::CustomMsg_");
  EXPECT_EQ(theirs.read_cdr, ours->read_cdr);
  EXPECT_EQ(ours->ros_name, "livox_ros_driver2/msg/CustomMsg");
}

TEST(Schema, CarriesEveryNestedDefinitionOnce) {
  const std::string schema(find_message_type("nav_msgs/msg/Odometry")->schema);
  for (const auto* part : {"MSG: std_msgs/Header",
                           "MSG: builtin_interfaces/Time",
                           "MSG: geometry_msgs/PoseWithCovariance",
                           "MSG: geometry_msgs/Quaternion"}) {
    const auto first = schema.find(part);
    ASSERT_NE(first, std::string::npos) << part;
    EXPECT_EQ(schema.find(std::string(part) + "\n", first + 1), std::string::npos) << part;
  }
}

TEST(Qos, TextForPeople) {
  EXPECT_EQ(to_string(qos::kSensorReader), "keep_last(5), best_effort, volatile");
  EXPECT_EQ(to_string(qos::kState), "keep_last(1), reliable, transient_local");
}

TEST(Qos, Rosbag2YamlHasItsIntegers) {
  const std::string latched = to_rosbag2_yaml(qos::kState);
  EXPECT_THAT(latched, HasSubstr("- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"));
  const std::string sensor = to_rosbag2_yaml(qos::kSensorReader);
  EXPECT_THAT(sensor, HasSubstr("depth: 5\n  reliability: 2\n  durability: 2\n"));
  EXPECT_THAT(sensor, HasSubstr("  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"));
}

}  // namespace
}  // namespace camvox::interfaces
