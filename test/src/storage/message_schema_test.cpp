#include "camvox/storage/message_schema.hpp"

#include <gmock/gmock.h>

#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/type_hash.hpp"
#include "mcap_files.hpp"
#include "message_definitions.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::SizeIs;

TEST(MessageSchema, ReadsEveryFormOfAField) {
  const auto schema = MessageSchema::parse("pkg/Mixed",
                                           "int32 A=-5  # a constant\n"
                                           "string TEXT=\"with # hash\"\n"
                                           "bool flag true\n"
                                           "string<=10 name 'it'\n"
                                           "float32[3] fixed [1.0, 2.0, 3.0]\n"
                                           "uint8[<=7] few\n"
                                           "string<=4[<=2] words\n"
                                           "Inner[] inners\n"
                                           "other_pkg/msg/Thing thing\n"
                                           "wstring wide\n" +
                                               dependency("pkg/Inner", "byte b\nchar c\n") +
                                               dependency("other_pkg/Thing", ""));
  ASSERT_TRUE(schema.ok()) << schema.status().message();
  const auto& root = schema->root();
  EXPECT_EQ(root.type, "pkg/msg/Mixed");
  ASSERT_THAT(root.constants, SizeIs(2));
  EXPECT_EQ(root.constants[0].value_text, "-5");
  EXPECT_EQ(root.constants[1].value_text, "with # hash");
  ASSERT_THAT(root.fields, SizeIs(8));
  EXPECT_EQ(root.fields[0].default_text, "true");
  EXPECT_EQ(root.fields[1].string_capacity, 10U);
  EXPECT_EQ(root.fields[2].array, FieldArray::kFixed);
  EXPECT_EQ(root.fields[2].array_size, 3U);
  EXPECT_EQ(root.fields[2].default_text, "[1.0, 2.0, 3.0]");
  EXPECT_EQ(root.fields[3].array, FieldArray::kBounded);
  EXPECT_EQ(root.fields[4].string_capacity, 4U);
  EXPECT_EQ(root.fields[4].array_size, 2U);
  EXPECT_EQ(root.fields[5].message_type, "pkg/msg/Inner");
  EXPECT_EQ(root.fields[5].array, FieldArray::kUnbounded);
  EXPECT_EQ(root.fields[6].message_type, "other_pkg/msg/Thing");
  EXPECT_EQ(schema->definition("pkg/msg/Inner").fields[1].kind, FieldKind::kChar);
}

TEST(MessageSchema, SaysEveryProblemWithItsLine) {
  const auto schema =
      MessageSchema::parse("pkg/T", "int32\nint32 9x\nint-3 y\nuint8[0] z\nint8 ok\n");
  EXPECT_THAT(schema.status().message(), HasSubstr("line 1: 'int32' has no name"));
  EXPECT_THAT(schema.status().message(), HasSubstr("line 2: '9x' is not a name"));
  EXPECT_THAT(schema.status().message(), HasSubstr("line 3: 'int-3' is not a type"));
  EXPECT_THAT(schema.status().message(), HasSubstr("line 4: 'uint8[0]' is not a type"));
}

TEST(MessageSchema, RefusesWhatCannotBeDecoded) {
  EXPECT_THAT(MessageSchema::parse("pkg/T", "Missing x").status().message(),
              HasSubstr("pkg/msg/Missing is used but not defined"));
  EXPECT_THAT(MessageSchema::parse("pkg/T", "T again").status().message(),
              HasSubstr("nests itself"));
  EXPECT_FALSE(MessageSchema::parse("no_package", "int32 x").ok());
  EXPECT_FALSE(MessageSchema::parse("pkg/T", "uint8[99999999999] x").ok());
  EXPECT_FALSE(MessageSchema::parse("pkg/T", "uint8[4000000000] x").ok());
  std::string chain = "T1 x\n";
  for (int i = 1; i < 100; ++i) {
    chain += dependency("pkg/T" + std::to_string(i), "T" + std::to_string(i + 1) + " x\n");
  }
  EXPECT_FALSE(MessageSchema::parse("pkg/T", chain + dependency("pkg/T100", "int8 x\n")).ok());
}

struct Known {
  const char* type;
  std::string text;
  const char* hash;
};

/// Hashes of rosidl's own generator (Jazzy).
TEST(TypeHash, EqualsThatOfRosidl) {
  const std::vector<Known> known = {
      {"builtin_interfaces/msg/Time",
       kTime,
       "RIHS01_b106235e25a4c5ed35098aa0a61a3ee9c9b18d197f398b0e4206cea9acf9c197"},
      {"std_msgs/msg/Header",
       kHeader + dependency("builtin_interfaces/Time", kTime),
       "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"},
      {"std_msgs/msg/String",
       "string data",
       "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"},
      {"sensor_msgs/msg/Image",
       kImage,
       "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"},
      {"sensor_msgs/msg/PointField",
       kPointField,
       "RIHS01_5c6a4750728c2bcfbbf7037225b20b02d4429634732146b742dee1726637ef01"},
      {"sensor_msgs/msg/PointCloud2",
       kPointCloud2,
       "RIHS01_9198cabf7da3796ae6fe19c4cb3bdd3525492988c70522628af5daa124bae2b5"},
      {"sensor_msgs/msg/Imu",
       kImu,
       "RIHS01_7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b"},
      {"tf2_msgs/msg/TFMessage",
       kTfMessage,
       "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"}};
  for (const auto& [type, text, hash] : known) {
    const auto schema = MessageSchema::parse(type, text);
    ASSERT_TRUE(schema.ok()) << schema.status().message();
    EXPECT_EQ(type_hash(*schema), hash) << type;
  }
}

/// rosbag2 records schema and hash side by side.
TEST(TypeHash, EqualsThatInRealRecordings) {
  const auto files = files_under(recordings() / "rosbag2", ".mcap");
  if (files.empty()) GTEST_SKIP() << "no rosbag2 files in " << recordings();
  int compared = 0;
  for (const auto& path : files) {
    const auto bag = BagReader::open(path);
    ASSERT_TRUE(bag.ok());
    for (const auto& topic : (*bag)->topics()) {
      // Of a service event rosbag2 records the text of the service, which is no message.
      if (topic.type.find("/srv/") != std::string::npos) continue;
      const auto schema = MessageSchema::parse(topic.type, topic.schema);
      if (topic.schema.empty()) continue;
      EXPECT_TRUE(schema.ok()) << path << schema.status().message();
      const bool has_hash = topic.type_description_hash.starts_with("RIHS01_");
      if (!schema.ok() || !has_hash) continue;
      EXPECT_EQ(type_hash(*schema), topic.type_description_hash) << topic.type;
      ++compared;
    }
  }
  EXPECT_GT(compared, 0);
}

}  // namespace
}  // namespace camvox::storage
