#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/bag_writer.hpp"

namespace camvox::recording {

inline constexpr std::int64_t kSecond_ns = 1'000'000'000;
inline constexpr std::int64_t kStart_ns = 1'700'000'000 * kSecond_ns;

/// A folder that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = std::filesystem::temp_directory_path() / ("camvox_" + std::to_string(getpid()) + "_" +
                                                      test->test_suite_name() + "_" + test->name());
    std::filesystem::remove_all(path_);
    std::filesystem::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { std::filesystem::remove_all(path_); }
  [[nodiscard]] std::string file(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

/// CDR of a message that starts with std_msgs/Header, then `content`.
inline std::vector<std::uint8_t> stamped_cdr(std::int64_t stamp_ns, std::uint8_t content) {
  std::vector<std::uint8_t> cdr = {0, 1, 0, 0};
  const auto append = [&](std::uint32_t number) {
    for (int shift = 0; shift < 32; shift += 8)
      cdr.push_back(static_cast<std::uint8_t>(number >> shift));
  };
  append(static_cast<std::uint32_t>(stamp_ns / kSecond_ns));
  append(static_cast<std::uint32_t>(stamp_ns % kSecond_ns));
  cdr.push_back(content);
  return cdr;
}

/// One message of a bag that a test makes.
struct TestMessage {
  std::string topic;
  double time_s = 0.0;
  std::uint8_t content = 0;
};

/// Writes a bag of the messages, each stamped with its log time.
inline void write_bag(const std::string& folder, const std::vector<TestMessage>& messages) {
  auto bag = storage::BagWriter::create(folder);
  ASSERT_TRUE(bag.ok()) << bag.status().message();
  std::map<std::string, std::size_t> numbers;
  for (const auto& message : messages) {
    if (!numbers.contains(message.topic)) {
      storage::BagTopic topic;
      topic.name = message.topic;
      topic.type = "test_msgs/msg/Stamped";
      topic.schema = "uint8 content\n";
      const auto number = (*bag)->add_topic(topic);
      ASSERT_TRUE(number.ok());
      numbers[message.topic] = *number;
    }
    const auto time_ns = kStart_ns + static_cast<std::int64_t>(message.time_s * 1e9);
    const auto cdr = stamped_cdr(time_ns, message.content);
    const auto status =
        (*bag)->write(numbers[message.topic], time_ns, time_ns, std::as_bytes(std::span(cdr)));
    ASSERT_TRUE(status.ok()) << status.message();
  }
  ASSERT_TRUE((*bag)->close().ok());
}

/// Changes a byte of the first message in a bag of write_bag, so that its chunk's CRC is wrong.
inline void damage_bag(const std::string& folder) {
  const auto file = std::filesystem::path(folder) /
                    (std::filesystem::path(folder).filename().string() + "_0.mcap");
  const auto cdr = stamped_cdr(kStart_ns, 0);
  std::ifstream in(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const auto at = bytes.find(std::string(cdr.begin(), cdr.end() - 1));
  ASSERT_NE(at, std::string::npos);
  bytes[at + cdr.size() - 1] ^= 1;
  std::ofstream(file, std::ios::binary) << bytes;
}

inline std::unique_ptr<storage::BagReader> open_bag(const std::string& folder) {
  auto bag = storage::BagReader::open(folder);
  EXPECT_TRUE(bag.ok()) << bag.status().message();
  return std::move(*bag);
}

}  // namespace camvox::recording
