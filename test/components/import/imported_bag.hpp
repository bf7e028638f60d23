#pragma once

#include <gmock/gmock.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "camvox/import/import_report.hpp"
#include "camvox/interfaces/message_type.hpp"
#include "camvox/storage/bag_reader.hpp"
#include "camvox/storage/cdr_value.hpp"
#include "camvox/storage/type_hash.hpp"

namespace camvox::import {

namespace fs = std::filesystem;

/// A folder that goes away with the test.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    path_ = fs::temp_directory_path() / ("camvox_" + std::to_string(getpid()) + "_" +
                                         test->test_suite_name() + "_" + test->name());
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { fs::remove_all(path_); }

  [[nodiscard]] const fs::path& path() const { return path_; }
  /// Writes a file and the folders above it.
  fs::path write(const fs::path& name, const std::string& text) const {
    fs::create_directories((path_ / name).parent_path());
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }

 private:
  fs::path path_;
};

/// A message of a bag with its log time.
template <typename T>
struct Logged {
  std::int64_t log_time_ns = 0;
  T message;
};

template <typename Stamped>
std::int64_t stamp_ns(const Stamped& message) {
  const auto& stamp = message.header().stamp();
  return std::int64_t{1'000'000'000} * stamp.sec() + stamp.nanosec();
}

/// A bag that an importer made. Opening it checks what must hold of every bag: it reads without a
/// problem, each message decodes by the definition that the bag itself carries, and each topic has
/// the hash of that definition.
class ImportedBag {
 public:
  explicit ImportedBag(const fs::path& folder) {
    auto reader = storage::BagReader::open(folder);
    if (!reader.ok()) throw std::runtime_error(reader.status().message());
    reader_ = *std::move(reader);
    EXPECT_TRUE(reader_->problems().empty());
    check_messages();
  }

  [[nodiscard]] std::map<std::string, std::uint64_t> counts() const {
    std::map<std::string, std::uint64_t> counts;
    for (const auto& topic : reader_->topics()) counts[topic.name] = topic.message_count;
    return counts;
  }
  [[nodiscard]] const storage::BagReader& reader() const { return *reader_; }

  /// All messages of a topic, read by their C++ type.
  template <typename T>
  [[nodiscard]] std::vector<Logged<T>> messages(const std::string& topic) const {
    std::vector<Logged<T>> found;
    auto cursor = reader_->messages();
    while (const auto* message = cursor.next()) {
      if (reader_->topics()[message->topic].name != topic) continue;
      EXPECT_EQ(reader_->topics()[message->topic].type, interfaces::message_type<T>().ros_name);
      auto& logged = found.emplace_back();
      logged.log_time_ns = message->log_time_ns;
      EXPECT_TRUE(interfaces::message_type<T>().read_cdr(
          reinterpret_cast<const std::uint8_t*>(message->data.data()),
          message->data.size(),
          &logged.message));
    }
    return found;
  }

 private:
  void check_messages() const {
    std::vector<storage::MessageSchema> schemas;
    for (const auto& topic : reader_->topics()) {
      auto schema = storage::MessageSchema::parse(topic.type, topic.schema);
      if (!schema.ok()) throw std::runtime_error(schema.status().message());
      EXPECT_EQ(topic.type_description_hash, storage::type_hash(*schema)) << topic.name;
      schemas.push_back(*std::move(schema));
    }
    auto cursor = reader_->messages();
    std::int64_t last_ns = 0;
    while (const auto* message = cursor.next()) {
      const auto decoded = storage::decode_cdr(schemas[message->topic], message->data);
      EXPECT_TRUE(decoded.ok()) << decoded.status().message();
      EXPECT_GE(message->log_time_ns, last_ns);
      last_ns = message->log_time_ns;
    }
    EXPECT_TRUE(cursor.status().ok()) << cursor.status().message();
  }

  std::unique_ptr<storage::BagReader> reader_;
};

/// The error of an import that must fail, and that must leave nothing behind in `folder`.
inline std::string error_of(const storage::Result<ImportReport>& result, const fs::path& output) {
  EXPECT_FALSE(result.ok());
  EXPECT_FALSE(fs::exists(output));
  for (const auto& entry : fs::directory_iterator(output.parent_path())) {
    EXPECT_EQ(entry.path().string().find(".partial"), std::string::npos) << entry.path();
  }
  return result.ok() ? std::string() : result.status().message();
}

}  // namespace camvox::import
