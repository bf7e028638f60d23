#include "camvox/storage/cdr_value.hpp"

#include <gmock/gmock.h>
#include <yaml-cpp/yaml.h>

#include <limits>
#include <random>

#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/byte_io.hpp"
#include "mcap_files.hpp"
#include "message_definitions.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;

/// CDR by the rules: alignment counts from behind the head.
class Cdr {
 public:
  explicit Cdr(bool little = true) : little_(little) {
    ByteWriter(out_).number(little ? std::uint32_t{0x00000100} : std::uint32_t{0});
  }
  template <typename T>
  Cdr& number(T value) {
    while ((out_.size() - 4) % sizeof(T) != 0) ByteWriter(out_).number(std::uint8_t{0xEE});
    std::byte raw[sizeof(T)];
    std::memcpy(raw, &value, sizeof(T));
    if (!little_) std::reverse(std::begin(raw), std::end(raw));
    out_.append(raw);
    return *this;
  }
  Cdr& string(const std::string& text) {
    number(static_cast<std::uint32_t>(text.size() + 1));
    out_.append(as_bytes(text));
    return number('\0');
  }
  Bytes bytes() const { return out_.view(); }

 private:
  ByteBuffer out_;
  bool little_;
};

MessageSchema schema_of(const std::string& type, const std::string& text) {
  auto schema = MessageSchema::parse(type, text);
  if (!schema.ok()) throw std::runtime_error(schema.status().message());
  return std::move(*schema);
}

Cdr imu_cdr(bool little = true) {
  Cdr cdr(little);
  cdr.number(std::int32_t{1700000000}).number(std::uint32_t{123456789}).string("livox_frame");
  for (int i = 0; i < 37; ++i) cdr.number(0.5 * i);
  return cdr;
}

TEST(CdrValue, FieldsAreFoundByTheirPathInBothByteOrders) {
  const auto schema = schema_of("sensor_msgs/msg/Imu", kImu);
  for (const bool little : {true, false}) {
    const Cdr cdr = imu_cdr(little);
    const auto imu = decode_cdr(schema, cdr.bytes());
    ASSERT_TRUE(imu.ok()) << imu.status().message();
    EXPECT_EQ(header_stamp_ns(*imu), 1700000000123456789);
    EXPECT_EQ(std::get<std::string>(imu->at("header.frame_id")->data), "livox_frame");
    EXPECT_EQ(imu->at("orientation.w")->as_double(), 1.5);
    EXPECT_EQ(imu->at("orientation_covariance[8]")->as_double(), 6.0);
    EXPECT_EQ(imu->at("linear_acceleration.z")->as_double(), 0.5 * 27);
    EXPECT_EQ(imu->at("linear_acceleration_covariance")->at("[0]")->as_double(), 14.0);
    for (const char* path : {"nothing",
                             "header.x",
                             "orientation_covariance[9]",
                             "[0]",
                             "header[",
                             "orientation_covariance[x]",
                             "header.stamp.sec.x"}) {
      EXPECT_FALSE(imu->at(path)) << path;
    }
  }
}

TEST(CdrValue, LargeArrayIsAViewOfTheMessage) {
  const auto schema = schema_of("sensor_msgs/msg/Image", kImage);
  Cdr cdr;
  cdr.number(std::int32_t{1}).number(std::uint32_t{2}).string("camera");
  cdr.number(std::uint32_t{2}).number(std::uint32_t{3}).string("mono8").number(std::uint8_t{0});
  cdr.number(std::uint32_t{3}).number(std::uint32_t{6});
  for (std::uint8_t i = 0; i < 6; ++i) cdr.number(i);
  const auto image = decode_cdr(schema, cdr.bytes());
  ASSERT_TRUE(image.ok()) << image.status().message();
  const auto field = image->at("data");
  ASSERT_TRUE(field);
  const auto& data = std::get<CdrArray>(field->data);
  EXPECT_EQ(data.size(), 6U);
  EXPECT_EQ(data.bytes.data() + 6, cdr.bytes().data() + cdr.bytes().size());
  EXPECT_EQ(
      to_yaml(*image, {.flow = true}),
      "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: camera\nheight: 2\nwidth: 3\n"
      "encoding: mono8\nis_bigendian: 0\nstep: 3\ndata: [0, 1, 2, 3, 4, 5]\n");
  EXPECT_THAT(to_yaml(*image, {.hide_arrays = true}),
              HasSubstr("data: '<sequence type: uint8, length: 6>'\n"));
  EXPECT_THAT(to_yaml(*image, {.max_array_length = 2}), HasSubstr("data:\n- 0\n- 1\n- '...'\n"));
}

TEST(CdrValue, SequencesOfMessagesPrintAsRos2TopicEchoDoes) {
  const auto schema = schema_of("tf2_msgs/msg/TFMessage", kTfMessage);
  Cdr cdr;
  cdr.number(std::uint32_t{1}).number(std::int32_t{5}).number(std::uint32_t{6}).string("map");
  cdr.string("odom");
  for (const double v : {1.0, 0.1, 1e-7, 0.0, 0.0, 0.0, 1.0}) cdr.number(v);
  const auto tf = decode_cdr(schema, cdr.bytes());
  ASSERT_TRUE(tf.ok()) << tf.status().message();
  EXPECT_EQ(tf->at("transforms[0].transform.translation.y")->as_double(), 0.1);
  EXPECT_EQ(to_yaml(*tf),
            "transforms:\n- header:\n    stamp:\n      sec: 5\n      nanosec: 6\n"
            "    frame_id: map\n  child_frame_id: odom\n  transform:\n    translation:\n"
            "      x: 1.0\n      y: 0.1\n      z: 1.0e-07\n    rotation:\n      x: 0.0\n"
            "      y: 0.0\n      z: 0.0\n      w: 1.0\n");
}

/// Every kind of scalar with its extreme values, against a YAML parser.
TEST(CdrValue, EveryKindComesBack) {
  const auto schema =
      schema_of("p/msg/All",
                "bool a\nint8 b\nuint8 c\nint16 d\nuint16 e\nint32 f\nuint32 g\n"
                "int64 h\nuint64 i\nfloat32 j\nfloat64 k\nstring l\nbyte m\nchar n\n"
                "wstring o\nstring[] p\nbool[2] q\nfloat32[<=3] r\n");
  Cdr cdr;
  cdr.number(true).number(std::int8_t{-128}).number(std::uint8_t{255});
  cdr.number(std::int16_t{-32768}).number(std::uint16_t{65535});
  cdr.number(std::numeric_limits<std::int32_t>::min()).number(~std::uint32_t{0});
  cdr.number(std::numeric_limits<std::int64_t>::min()).number(~std::uint64_t{0});
  cdr.number(0.1F).number(-1e300).string("x: y").number(std::uint8_t{7}).number(std::uint8_t{8});
  cdr.number(std::uint32_t{2}).number(std::uint32_t{'A'}).number(std::uint32_t{0xE9});
  cdr.number(std::uint32_t{2}).string("").string("b").number(true).number(false);
  cdr.number(std::uint32_t{1}).number(2.5F);
  const auto value = decode_cdr(schema, cdr.bytes());
  ASSERT_TRUE(value.ok()) << value.status().message();
  const auto yaml = YAML::Load(to_yaml(*value));
  EXPECT_EQ(yaml["a"].as<bool>(), true);
  EXPECT_EQ(yaml["b"].as<int>(), -128);
  EXPECT_EQ(yaml["c"].as<int>(), 255);
  EXPECT_EQ(yaml["d"].as<int>(), -32768);
  EXPECT_EQ(yaml["e"].as<int>(), 65535);
  EXPECT_EQ(yaml["f"].as<std::int64_t>(), std::numeric_limits<std::int32_t>::min());
  EXPECT_EQ(yaml["g"].as<std::uint32_t>(), ~std::uint32_t{0});
  EXPECT_EQ(yaml["h"].as<std::int64_t>(), std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(yaml["i"].as<std::uint64_t>(), ~std::uint64_t{0});
  EXPECT_EQ(yaml["j"].Scalar(), "0.1");
  EXPECT_EQ(yaml["k"].as<double>(), -1e300);
  EXPECT_EQ(yaml["l"].as<std::string>(), "x: y");
  EXPECT_EQ(yaml["n"].as<int>(), 8);
  EXPECT_EQ(yaml["o"].as<std::string>(), "A\xC3\xA9");
  EXPECT_EQ(yaml["p"][1].as<std::string>(), "b");
  EXPECT_EQ(yaml["q"][0].as<bool>(), true);
  EXPECT_EQ(yaml["r"][0].as<float>(), 2.5F);
}

TEST(CdrValue, CutAtEveryByteIsAnError) {
  const auto schema = schema_of("sensor_msgs/msg/Imu", kImu);
  const Cdr cdr = imu_cdr();
  for (std::size_t size = 0; size < cdr.bytes().size(); ++size) {
    EXPECT_EQ(decode_cdr(schema, cdr.bytes().first(size)).status().code(), StatusCode::kTruncated);
  }
}

TEST(CdrValue, ForgedCountsDoNotTakeMemory) {
  const auto bytes = [](std::uint32_t count) {
    Cdr cdr;
    cdr.number(count);
    return cdr;
  };
  const auto numbers = schema_of("p/msg/T", "float64[] x");
  EXPECT_EQ(decode_cdr(numbers, bytes(~0U).bytes()).status().code(), StatusCode::kTruncated);
  // Elements without fields have a byte each, so that the data end this too.
  const auto empty = schema_of("p/msg/T", "E[] x\n" + dependency("p/E", ""));
  EXPECT_EQ(decode_cdr(empty, bytes(~0U).bytes()).status().code(), StatusCode::kTruncated);
  EXPECT_TRUE(decode_cdr(schema_of("p/msg/E", ""), Cdr().bytes()).ok());
  EXPECT_TRUE(decode_cdr(schema_of("p/msg/E", ""), Cdr().number('\0').bytes()).ok());
  const auto bounded = schema_of("p/msg/T", "uint8[<=3] x");
  EXPECT_EQ(decode_cdr(bounded, bytes(4).bytes()).status().code(), StatusCode::kCorrupt);
  EXPECT_EQ(decode_cdr(numbers, as_bytes(std::string_view("\0\3\0\0\0\0\0\0", 8))).status().code(),
            StatusCode::kUnsupported);
}

TEST(CdrValue, ForgedStampsAreNone) {
  const auto schema =
      schema_of("p/msg/T", "S stamp\n" + dependency("p/S", "int64 sec\nint64 nanosec"));
  const auto stamp_ns = [&](std::int64_t sec, std::int64_t nanosec) {
    const auto message = decode_cdr(schema, Cdr().number(sec).number(nanosec).bytes());
    return message.ok() ? header_stamp_ns(*message) : -1;
  };
  constexpr auto kLeast = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(stamp_ns(-2, 5), -1'999'999'995);
  EXPECT_EQ(stamp_ns(INT32_MIN, 0), std::int64_t{INT32_MIN} * 1'000'000'000);
  EXPECT_EQ(stamp_ns(kLeast, 0), std::nullopt);
  EXPECT_EQ(stamp_ns(std::int64_t{INT32_MAX} + 1, 0), std::nullopt);
  EXPECT_EQ(stamp_ns(-1, kLeast), std::nullopt);
}

TEST(CdrValue, NoiseIsSurvived) {
  std::mt19937 random(3);
  const auto schema = schema_of("tf2_msgs/msg/TFMessage", kTfMessage);
  for (int round = 0; round < 5000; ++round) {
    std::string noise(4 + random() % 200, '\0');
    for (char& c : noise) c = static_cast<char>(random() % 4 == 0 ? random() : 0);
    noise[1] = 1;
    noise[0] = 0;
    const auto value = decode_cdr(schema, as_bytes(noise));
    if (value.ok()) (void)to_yaml(*value);
  }
}

TEST(CdrValue, MessagesOfRealRecordingsDecodeToTheirLastByte) {
  const auto path = recordings() / "rosbag2" / "nav2_turtlebot.mcap";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const auto bag = BagReader::open(path);
  ASSERT_TRUE(bag.ok());
  std::map<std::size_t, MessageSchema> schemas;
  for (std::size_t i = 0; i < (*bag)->topics().size(); ++i) {
    const auto& topic = (*bag)->topics()[i];
    schemas.emplace(i, schema_of(topic.type, topic.schema));
  }
  auto cursor = (*bag)->messages();
  int count = 0;
  while (const BagMessage* message = cursor.next()) {
    const auto value = decode_cdr(schemas.at(message->topic), message->data);
    ASSERT_TRUE(value.ok()) << value.status().message();
    // Without its last byte it must not decode: all of it was read.
    const auto cut = message->data.first(message->data.size() - 1);
    EXPECT_FALSE(decode_cdr(schemas.at(message->topic), cut).ok());
    EXPECT_TRUE(YAML::Load(to_yaml(*value)).IsMap());
    ++count;
  }
  EXPECT_GT(count, 100);
}

}  // namespace
}  // namespace camvox::storage
