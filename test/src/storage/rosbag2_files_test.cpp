/// Files that `ros2 bag` wrote.
#include <gmock/gmock.h>

#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

class Rosbag2Files : public ::testing::Test {
 protected:
  void SetUp() override {
    files_ = files_under(recordings() / "rosbag2", ".mcap");
    if (files_.empty()) GTEST_SKIP() << "no rosbag2 files in " << recordings();
  }
  std::vector<std::filesystem::path> files_;
};

TEST_F(Rosbag2Files, StreamAndIndexAgreeAndAllChecksumsHold) {
  for (const auto& path : files_) {
    const auto source = FileSource::open(path);
    ASSERT_TRUE(source.ok());
    McapStreamReader stream(**source);
    std::vector<TestMessage> expected;
    while (const Record* record = stream.next()) {
      if (const auto* message = std::get_if<Message>(record)) expected.push_back(copy_of(*message));
    }
    EXPECT_TRUE(stream.status().ok()) << path << stream.status().message();
    EXPECT_TRUE(stream.problems().empty()) << path;
    EXPECT_FALSE(expected.empty());
    std::stable_sort(expected.begin(), expected.end(), [](const auto& a, const auto& b) {
      return a.log_time_ns < b.log_time_ns;
    });

    const auto reader = McapIndexedReader::open(path);
    ASSERT_TRUE(reader.ok()) << reader.status().message();
    std::vector<TestMessage> actual;
    auto cursor = (*reader)->messages();
    while (const Message* message = cursor.next()) actual.push_back(copy_of(*message));
    EXPECT_TRUE(cursor.status().ok()) << cursor.status().message();
    EXPECT_EQ(actual, expected) << path;
    EXPECT_EQ((*reader)->summary().header.profile, "ros2");
    EXPECT_EQ((*reader)->summary().statistics.message_count, expected.size()) << path;
    EXPECT_FALSE((*reader)->summary().rebuilt)
        << path << (*reader)->summary().problems[0].status.message();
  }
}

TEST_F(Rosbag2Files, ScanRebuildsTheSummaryThatTheFileHas) {
  for (const auto& path : files_) {
    const auto source = FileSource::open(path);
    ASSERT_TRUE(source.ok());
    const auto own = read_summary(**source, {});
    const auto scanned = scan_summary(**source, {});
    ASSERT_TRUE(own.ok() && scanned.ok()) << path << own.status().message();
    // The recorder lists channels without messages in the summary only.
    for (const auto& [id, channel] : scanned->channels) EXPECT_EQ(own->channels.at(id), channel);
    for (const auto& [id, schema] : scanned->schemas) EXPECT_EQ(own->schemas.at(id), schema);
    EXPECT_EQ(own->statistics.channel_count, scanned->channels.size()) << path;
    EXPECT_EQ(own->metadata_indexes, scanned->metadata_indexes) << path;
    EXPECT_EQ(own->statistics.message_count, scanned->statistics.message_count) << path;
    ASSERT_EQ(own->chunk_indexes.size(), scanned->chunk_indexes.size()) << path;
    EXPECT_TRUE(scanned->problems.empty());
  }
}

}  // namespace
}  // namespace camvox::storage
