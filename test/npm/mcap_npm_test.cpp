/// A second implementation reads what we write and writes what we read.
#include <gmock/gmock.h>

#include <cstdio>
#include <cstdlib>

#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/bag_writer.hpp"
#include "camvox/storage/byte_io.hpp"
#include "camvox/storage/cdr_value.hpp"
#define CAMVOX_PROJECT_ROOT ""
#include "mcap_files.hpp"
#include "message_definitions.hpp"

namespace camvox::storage {
namespace {

const std::map<std::string, std::pair<std::string, std::string>> kTopics = {
    {"/image", {"sensor_msgs/msg/Image", kImage}},
    {"/imu", {"sensor_msgs/msg/Imu", kImu}},
    {"/tf", {"tf2_msgs/msg/TFMessage", kTfMessage}}};

struct Output {
  int code = -1;
  std::string text;
};

Output run(const std::string& command) {
  Output output;
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return output;
  char buffer[4096];
  for (std::size_t n = 0; (n = std::fread(buffer, 1, sizeof(buffer), pipe)) > 0;) {
    output.text.append(buffer, n);
  }
  output.code = ::pclose(pipe);
  return output;
}

std::string hex(Bytes bytes) {
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : bytes) {
    text += kDigits[std::to_integer<unsigned>(b) >> 4U];
    text += kDigits[std::to_integer<unsigned>(b) & 0xFU];
  }
  return text;
}

/// Bits of the number as float64, most significant first.
std::string bits_of(double number) {
  std::array<std::byte, sizeof(number)> raw;
  std::memcpy(raw.data(), &number, sizeof(number));
  std::reverse(raw.begin(), raw.end());
  return hex(raw);
}

void flatten(const std::string& path, const CdrValue& value, std::string& out) {
  const auto elements = [&](const auto& size, const auto& get) {
    out += " " + path + "#" + std::to_string(size);
    for (std::size_t i = 0; i < size; ++i) {
      flatten(path + "[" + std::to_string(i) + "]", get(i), out);
    }
  };
  if (const auto* text = std::get_if<std::string>(&value.data)) {
    out += " " + path + "=\"" + hex(as_bytes(*text)) + "\"";
  } else if (const auto* members = std::get_if<CdrMembers>(&value.data)) {
    for (const auto& member : *members) flatten(path + "." + member.name, member.value, out);
  } else if (const auto* array = std::get_if<CdrArray>(&value.data)) {
    elements(array->size(), [&](std::size_t i) { return array->element(i); });
  } else if (const auto* list = std::get_if<CdrList>(&value.data)) {
    elements(list->size(), [&](std::size_t i) { return (*list)[i]; });
  } else {
    out += " " + path + "=" + bits_of(value.as_double().value());
  }
}

/// Every field of every message, one line each; the same text comes from mcap_roundtrip.mjs.
std::string describe(const std::filesystem::path& path) {
  const auto bag = BagReader::open(path);
  EXPECT_TRUE(bag.ok()) << bag.status().message();
  if (!bag.ok()) return "";
  EXPECT_TRUE((*bag)->problems().empty());
  std::string text;
  auto cursor = (*bag)->messages();
  while (const BagMessage* message = cursor.next()) {
    const auto& topic = (*bag)->topics()[message->topic];
    const auto schema = MessageSchema::parse(topic.type, topic.schema);
    EXPECT_TRUE(schema.ok()) << schema.status().message();
    const auto value = decode_cdr(*schema, message->data);
    EXPECT_TRUE(value.ok()) << value.status().message();
    text += topic.name + " " + std::to_string(message->sequence) + " " +
            std::to_string(message->log_time_ns) + " " + std::to_string(message->publish_time_ns);
    if (value.ok()) flatten("", *value, text);
    text += "\n";
  }
  EXPECT_TRUE(cursor.status().ok()) << cursor.status().message();
  return text;
}

class McapNpm : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (run("node --version 2>&1 && npm --version 2>&1").code != 0) {
      reason_ = "node or npm is not installed";
      return;
    }
    folder_ = std::filesystem::path(CAMVOX_NPM_BINARY) / "npm";
    std::filesystem::create_directories(folder_);
    for (const char* name : {"package.json", "package-lock.json", ".npmrc", "mcap_roundtrip.mjs"}) {
      std::filesystem::copy_file(std::filesystem::path(CAMVOX_NPM_SOURCE) / name,
                                 folder_ / name,
                                 std::filesystem::copy_options::overwrite_existing);
    }
    const auto install = run("cd '" + folder_.string() + "' && npm ci --ignore-scripts 2>&1");
    if (install.code != 0) reason_ = "the npm packages cannot be installed:\n" + install.text;
    for (const auto& [topic, schema] : kTopics) {
      std::string name = schema.first;
      std::replace(name.begin(), name.end(), '/', '_');
      write_text(folder_ / (name + ".txt"), schema.second);
    }
  }

  void SetUp() override {
    if (!reason_.empty()) GTEST_SKIP() << reason_;
  }

  static Output node(const std::string& arguments) {
    return run("cd '" + folder_.string() + "' && node mcap_roundtrip.mjs " + arguments + " 2>&1");
  }

  static inline std::filesystem::path folder_;
  static inline std::string reason_;
};

TEST_F(McapNpm, WhatNpmWritesIsReadHereWithEveryField) {
  for (const std::string compression : {"none", "zstd"}) {
    const auto path = folder_ / ("theirs_" + compression + ".mcap");
    const auto theirs = node("write '" + path.string() + "' . " + compression);
    ASSERT_EQ(theirs.code, 0) << theirs.text;
    EXPECT_EQ(std::count(theirs.text.begin(), theirs.text.end(), '\n'), 60);
    EXPECT_EQ(describe(path), theirs.text);
  }
}

/// Our file: the messages that npm made (checked above), through our writer.
TEST_F(McapNpm, WhatIsWrittenHereIsReadByNpmWithEveryField) {
  const auto theirs = folder_ / "source.mcap";
  ASSERT_EQ(node("write '" + theirs.string() + "' . none").code, 0);
  const auto source = BagReader::open(theirs);
  ASSERT_TRUE(source.ok());
  for (const auto compression : {Compression::kNone, Compression::kLz4, Compression::kZstd}) {
    const auto folder = folder_ / "ours";
    std::filesystem::remove_all(folder);
    BagWriterOptions options;
    options.mcap.compression = compression;
    options.mcap.chunk_size = 3000;
    auto writer = BagWriter::create(folder, options);
    ASSERT_TRUE(writer.ok());
    for (const auto& topic : (*source)->topics()) ASSERT_TRUE((*writer)->add_topic(topic).ok());
    auto cursor = (*source)->messages();
    while (const BagMessage* m = cursor.next()) {
      ASSERT_TRUE((*writer)
                      ->write(m->topic, m->log_time_ns, m->publish_time_ns, m->data, m->sequence)
                      .ok());
    }
    ASSERT_TRUE((*writer)->close().ok());
    const auto ours = node("read '" + (folder / "ours_0.mcap").string() + "'");
    EXPECT_EQ(ours.code, 0) << ours.text;
    EXPECT_EQ(ours.text, describe(theirs));
  }
}

}  // namespace
}  // namespace camvox::storage
