#include "camvox/storage/indexed_reader.hpp"

#include <gmock/gmock.h>

#include <random>

#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::unique_ptr<McapIndexedReader> open(const std::string& file,
                                        IndexedReaderOptions options = {}) {
  auto reader = McapIndexedReader::open(std::make_unique<MemorySource>(as_bytes(file)), options);
  if (!reader.ok()) throw std::runtime_error(reader.status().message());
  return std::move(*reader);
}

std::vector<TestMessage> read_all(MessageCursor cursor) {
  std::vector<TestMessage> messages;
  while (const Message* message = cursor.next()) messages.push_back(copy_of(*message));
  EXPECT_TRUE(cursor.status().ok()) << cursor.status().message();
  return messages;
}

/// What the reader must give, by brute force.
std::vector<TestMessage> expected(std::vector<TestMessage> messages, const MessageFilter& filter) {
  const auto unwanted = [&](const TestMessage& m) {
    const std::string topic = m.channel_id == 1 ? "/a" : "/b";
    const auto& topics = filter.topics;
    return m.log_time_ns < filter.start_time_ns || m.log_time_ns > filter.end_time_ns ||
           (!topics.empty() && std::find(topics.begin(), topics.end(), topic) == topics.end());
  };
  std::erase_if(messages, unwanted);
  std::stable_sort(messages.begin(), messages.end(), [](const auto& a, const auto& b) {
    return a.log_time_ns < b.log_time_ns;
  });
  return messages;
}

/// Messages whose times go back and forth by up to `spread_ns`, so that chunks overlap.
std::vector<TestMessage> shuffled(std::uint32_t count, std::uint64_t spread_ns, unsigned seed) {
  std::mt19937 random(seed);
  auto messages = make_messages(count, 40);
  for (auto& message : messages) message.log_time_ns += random() % spread_ns;
  return messages;
}

struct Layout {
  const char* name;
  McapWriterOptions options;
};

Layout layout(const char* name, Compression compression, bool chunked, bool summary) {
  McapWriterOptions options;
  options.compression = compression;
  options.chunked = chunked;
  options.chunk_size = 600;
  if (!summary) {
    options.chunk_index = options.statistics = options.repeat_channels = false;
    options.repeat_schemas = options.message_index = options.summary_offsets = false;
  }
  return {name, options};
}

class IndexedReaderLayouts : public ::testing::TestWithParam<Layout> {};

TEST_P(IndexedReaderLayouts, MessagesComeInOrderOfTimeThroughEveryFilter) {
  const std::vector<MessageFilter> filters = {
      {},
      {.start_time_ns = 1500, .end_time_ns = 2500, .topics = {}},
      {.start_time_ns = 1500, .end_time_ns = 2500, .topics = {"/b"}},
      {.start_time_ns = 0, .end_time_ns = 999, .topics = {}},
      {.start_time_ns = 1 << 30, .topics = {}},
      {.topics = {"/a", "/b"}},
      {.topics = {"/none"}}};
  for (const std::uint64_t spread_ns : {1U, 30U, 700U, 100000U}) {
    const auto messages = shuffled(300, spread_ns, 7);
    const std::string file = write_file(messages, GetParam().options);
    const auto reader = open(file);
    EXPECT_EQ(reader->summary().statistics.message_count, 300U);
    for (const auto& filter : filters) {
      EXPECT_EQ(read_all(reader->messages(filter)), expected(messages, filter)) << spread_ns;
    }
  }
}

TEST_P(IndexedReaderLayouts, SmallCacheGivesTheSame) {
  const auto messages = shuffled(300, 100000, 3);
  const std::string file = write_file(messages, GetParam().options);
  EXPECT_EQ(read_all(open(file, {.limits = {}, .cache_size = 0})->messages()),
            expected(messages, {}));
}

TEST_P(IndexedReaderLayouts, FileAndMemoryGiveTheSame) {
  const auto messages = make_messages(50, 3000);
  const auto folder = fresh_folder(std::string("indexed_reader_") + GetParam().name);
  write_text(folder / "a.mcap", write_file(messages, GetParam().options));
  const auto reader = McapIndexedReader::open(folder / "a.mcap");
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ(read_all((*reader)->messages()), messages);
  auto cursor = (*reader)->messages({.topics = {"/b"}});
  ASSERT_NE(cursor.next(), nullptr);
  EXPECT_EQ(cursor.channel().topic, "/b");
}

INSTANTIATE_TEST_SUITE_P(
    All,
    IndexedReaderLayouts,
    ::testing::Values(layout("none", Compression::kNone, true, true),
                      layout("lz4", Compression::kLz4, true, true),
                      layout("zstd", Compression::kZstd, true, true),
                      layout("unchunked", Compression::kNone, false, true),
                      layout("no_summary", Compression::kZstd, true, false),
                      layout("unchunked_no_summary", Compression::kNone, false, false)),
    [](const auto& parameter) { return parameter.param.name; });

TEST(IndexedReader, EqualTimesKeepTheOrderOfTheFile) {
  auto messages = make_messages(100, 10);
  for (auto& message : messages) message.log_time_ns = 5;
  McapWriterOptions options;
  options.chunk_size = 200;
  EXPECT_EQ(read_all(open(write_file(messages, options))->messages()), messages);
}

TEST(IndexedReader, EmptyFileHasNoMessages) {
  for (const bool chunked : {true, false}) {
    McapWriterOptions options;
    options.chunked = chunked;
    const std::string file = write_file({}, options);
    const auto reader = open(file);
    EXPECT_THAT(read_all(reader->messages()), IsEmpty());
    EXPECT_THAT(reader->summary().channels, SizeIs(2));
    EXPECT_FALSE(reader->summary().rebuilt);
  }
}

TEST(IndexedReader, FileThatWasNotClosedGivesAllFinishedChunks) {
  McapWriterOptions options;
  options.chunk_size = 1000;
  const auto messages = make_messages(100, 100);
  const std::string file = write_file(messages, options, false);
  const auto reader = open(file);
  EXPECT_TRUE(reader->summary().rebuilt);
  EXPECT_THAT(reader->summary().problems[0].status.message(), HasSubstr("not closed"));
  EXPECT_EQ(read_all(reader->messages()), messages);
}

TEST(IndexedReader, DamagedChunkStopsOrIsSkippedAsTheCallerWants) {
  McapWriterOptions options;
  options.chunk_size = 1000;
  std::string file = write_file(make_messages(100, 100), options);
  const auto& index = open(file)->summary().chunk_indexes.at(4);
  const auto middle = static_cast<std::size_t>(index.chunk_start_offset + index.chunk_length / 2);
  file[middle] = static_cast<char>(file[middle] ^ 1);
  auto cursor_reader = open(file);
  auto cursor = cursor_reader->messages();
  std::size_t before = 0;
  while (cursor.next() != nullptr) ++before;
  EXPECT_EQ(cursor.status().code(), StatusCode::kCrcMismatch);
  EXPECT_THAT(cursor.status().message(), HasSubstr("offset"));
  EXPECT_GT(before, 20U);

  const auto skipping = open(file, {.limits = {}, .skip_bad_chunks = true});
  auto all = skipping->messages();
  std::size_t count = 0;
  while (all.next() != nullptr) ++count;
  EXPECT_TRUE(all.status().ok());
  EXPECT_THAT(all.problems(), SizeIs(1));
  EXPECT_GT(count, before);
  EXPECT_LT(count, 100U);
}

/// Many indexes that lead to one chunk would make a small file take hours.
TEST(IndexedReader, RepeatedChunkIndexIsNotBelieved) {
  McapWriterOptions options;
  const auto messages = make_messages(10, 100);
  const std::string file = write_file(messages, options);
  const MemorySource source(as_bytes(file));
  const auto summary = read_summary(source, {});
  ASSERT_TRUE(summary.ok());
  ByteBuffer forged;
  const std::size_t footer_start = file.size() - kMagic.size() - kFooterRecordSize;
  forged.append(as_bytes(std::string_view(file).substr(0, footer_start)));
  encode_record(summary->chunk_indexes[0], forged);
  const std::uint64_t summary_start = file.find(std::string("\x0f\x04\0\0\0\0\0\0\0", 9)) + 13;
  encode_record(Footer{summary_start, 0, 0}, forged);
  forged.append(as_bytes(kMagic));
  const std::string text(as_text(forged.view()));
  const auto reader = open(text);
  EXPECT_TRUE(reader->summary().rebuilt);
  EXPECT_EQ(read_all(reader->messages()), messages);
}

TEST(IndexedReader, MetadataAndAttachmentsAreFoundByTheirIndex) {
  ByteBuffer out;
  McapWriter writer;
  ASSERT_TRUE(writer.open(std::make_unique<MemorySink>(out)).ok());
  ASSERT_TRUE(writer.write(Metadata{"rosbag2", {{"k", "old"}}}).ok());
  ASSERT_TRUE(writer.write(Metadata{"rosbag2", {{"k", "new"}}}).ok());
  ASSERT_TRUE(writer.write(Attachment{1, 2, "log.txt", "text/plain", as_bytes("hello"), 0}).ok());
  ASSERT_TRUE(writer.close().ok());
  std::string file(as_text(out.view()));
  const auto reader = open(file);
  EXPECT_EQ(reader->metadata("rosbag2")->metadata.at("k"), "new");
  EXPECT_EQ(reader->metadata("other").status().code(), StatusCode::kInvalid);
  ByteBuffer scratch;
  const auto& index = reader->summary().attachment_indexes.at(0);
  EXPECT_EQ(as_text(reader->attachment(index, scratch)->data), "hello");
  file[file.find("hello")] = 'j';
  EXPECT_EQ(open(file)->attachment(index, scratch).status().code(), StatusCode::kCrcMismatch);
}

TEST(IndexedReader, WhatIsNotAnMcapFileIsRefused) {
  for (const std::string text : {"", "MCAP", "this is not an MCAP file at all"}) {
    const auto reader = McapIndexedReader::open(std::make_unique<MemorySource>(as_bytes(text)));
    EXPECT_EQ(reader.status().code(), StatusCode::kBadMagic) << text;
  }
  EXPECT_EQ(McapIndexedReader::open("/nonexistent/a.mcap").status().code(), StatusCode::kIo);
  EXPECT_EQ(McapIndexedReader::open("/tmp").status().code(), StatusCode::kIo);
}

}  // namespace
}  // namespace camvox::storage
