#include "camvox/storage/writer.hpp"

#include <gmock/gmock.h>

#include "camvox/storage/doctor.hpp"
#include "camvox/storage/recover.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<TestMessage> read_messages(std::string_view file) {
  const MemorySource source(as_bytes(file));
  McapStreamReader reader(source);
  std::vector<TestMessage> messages;
  while (const Record* record = reader.next()) {
    if (const auto* message = std::get_if<Message>(record)) messages.push_back(copy_of(*message));
  }
  EXPECT_TRUE(reader.status().ok()) << reader.status().message();
  EXPECT_THAT(reader.problems(), IsEmpty());
  return messages;
}

std::vector<Finding> examine(std::string_view file) {
  const MemorySource source(as_bytes(file));
  return doctor(source).findings;
}

struct Case {
  Compression compression;
  int level;
  bool chunked;
};

class WriterRoundTrip : public ::testing::TestWithParam<Case> {};

TEST_P(WriterRoundTrip, GivesBackTheMessagesAndAFileInOrder) {
  for (const std::size_t size : {0UL, 1UL, 100UL, 70'000UL, 3'000'000UL}) {
    McapWriterOptions options;
    options.compression = GetParam().compression;
    options.compression_level = GetParam().level;
    options.chunked = GetParam().chunked;
    const auto messages = make_messages(size > 1'000'000 ? 5 : 40, size);
    const std::string file = write_file(messages, options);
    EXPECT_EQ(read_messages(file), messages) << size;
    EXPECT_THAT(examine(file), IsEmpty()) << size;
    EXPECT_EQ(write_file(messages, options), file) << "not repeatable, size " << size;
  }
}

INSTANTIATE_TEST_SUITE_P(All,
                         WriterRoundTrip,
                         ::testing::Values(Case{Compression::kNone, 0, true},
                                           Case{Compression::kNone, 0, false},
                                           Case{Compression::kLz4, 0, true},
                                           Case{Compression::kLz4, 9, true},
                                           Case{Compression::kZstd, 0, true},
                                           Case{Compression::kZstd, -5, true},
                                           Case{Compression::kZstd, 19, true}));

/// Large messages go to the sink without a copy; every mixture with small ones must be the same
/// file as the copying path makes, which compression none and a size under the threshold stand for.
TEST(Writer, LargeAndSmallMessagesMix) {
  std::vector<TestMessage> messages;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const std::size_t size = i % 3 == 0 ? 200'000 : i % 5 == 0 ? 1'200'000 : 10;
    messages.push_back(
        {static_cast<std::uint16_t>(1 + i % 2), i, 100ULL - i, std::string(size, 'x')});
  }
  const std::string file = write_file(messages, {});
  EXPECT_EQ(read_messages(file), messages);
  const auto findings = examine(file);
  ASSERT_EQ(findings.size(), 1U);  // log times go down
  EXPECT_EQ(findings[0].severity, Severity::kWarning);
}

TEST(Writer, EqualDefinitionsShareAnIdAndContradictionsAreRefused) {
  McapWriter writer;
  EXPECT_EQ(*writer.add_schema("a", "ros2msg", "x"), 1);
  EXPECT_EQ(*writer.add_schema("b", "ros2msg", "x"), 2);
  EXPECT_EQ(*writer.add_schema("a", "ros2msg", "x"), 1);
  EXPECT_EQ(*writer.add_channel(1, "/t", "cdr"), 1);
  EXPECT_EQ(*writer.add_channel(2, "/t", "cdr"), 2);
  EXPECT_EQ(*writer.add_channel(1, "/t", "cdr"), 1);
  EXPECT_THAT(writer.add_channel(9, "/u", "cdr").status().message(), HasSubstr("id 9"));
  EXPECT_THAT(writer.add_schema(Schema{1, "c", "", ""}).message(), HasSubstr("already"));
  EXPECT_THAT(writer.add_schema(Schema{0, "c", "", ""}).message(), HasSubstr("id 0"));
  EXPECT_THAT(writer.add_channel(Channel{1, 1, "/v", "cdr", {}}).message(), HasSubstr("already"));
}

TEST(Writer, MistakesAreSaidAndDoNotEndTheFile) {
  ByteBuffer out;
  McapWriter writer;
  EXPECT_EQ(writer.write(Message{}).code(), StatusCode::kInvalid);
  ASSERT_TRUE(writer.open(std::make_unique<MemorySink>(out)).ok());
  EXPECT_EQ(writer.open(std::make_unique<MemorySink>(out)).code(), StatusCode::kInvalid);
  EXPECT_THAT(writer.write(Message{.channel_id = 7, .data = {}}).message(), HasSubstr("id 7"));
  EXPECT_TRUE(writer.close().ok());
  EXPECT_EQ(writer.close().code(), StatusCode::kInvalid);
  EXPECT_EQ(writer.write(Metadata{}).code(), StatusCode::kInvalid);
  EXPECT_THAT(examine(as_text(out.view())), IsEmpty());
}

/// A disk with room for so many bytes.
class SmallDisk final : public Sink {
 public:
  SmallDisk(ByteBuffer& out, std::size_t room) : out_(out), room_(room) {}
  Status write(std::span<const Bytes> parts) override {
    for (const Bytes part : parts) {
      const std::size_t fits = std::min(part.size(), room_ - out_.size());
      out_.append(part.first(fits));
      if (fits < part.size()) return {StatusCode::kIo, "No space left on device"};
    }
    return {};
  }
  Status flush() override { return {}; }
  Status close() override { return {}; }

 private:
  ByteBuffer& out_;
  std::size_t room_;
};

TEST(Writer, FullDiskIsReportedOnceAndForAllAndEveryFinishedChunkIsRecovered) {
  const auto messages = make_messages(40, 60);
  McapWriterOptions options;
  options.chunk_size = 500;
  const std::size_t whole = write_file(messages, options).size();
  for (std::size_t room = 0; room <= whole; room += 7) {
    ByteBuffer out;
    McapWriter writer(options);
    Status status = writer.open(std::make_unique<SmallDisk>(out, room));
    if (status.ok()) status = writer.add_schema(Schema{1, "pkg/msg/A", "ros2msg", "int32 a"});
    if (status.ok()) status = writer.add_channel(Channel{1, 1, "/a", "cdr", {}});
    std::uint64_t safe = 0;
    for (auto message : messages) {
      message.channel_id = 1;
      if (!status.ok()) break;
      status = writer.write(view_of(message));
      if (status.ok() && writer.size() == out.size()) safe = writer.statistics().message_count;
    }
    if (status.ok()) status = writer.close();
    if (status.ok()) continue;
    EXPECT_EQ(status.code(), StatusCode::kIo);
    EXPECT_EQ(writer.write(Metadata{}).code(), StatusCode::kIo);
    EXPECT_EQ(writer.close().code(), StatusCode::kIo);
    if (out.size() < kMagic.size()) continue;
    ByteBuffer copy;
    const MemorySource source(out.view());
    const auto recovered = recover(source, std::make_unique<MemorySink>(copy));
    ASSERT_TRUE(recovered.status.ok());
    EXPECT_GE(recovered.statistics.message_count, safe) << room;
  }
}

TEST(Writer, DeviceThatIsFullIsReported) {
  auto sink = FileSink::create("/dev/full");
  if (!sink.ok()) GTEST_SKIP() << "no /dev/full here: " << sink.status().message();
  McapWriter writer;
  const auto status = writer.open(std::move(*sink));
  EXPECT_EQ(status.code(), StatusCode::kIo);
  EXPECT_THAT(status.message(), HasSubstr("/dev/full"));
  EXPECT_THAT(status.message(), HasSubstr("No space left"));
}

TEST(Writer, FileOnDiskIsWholeWithAndWithoutWaitingForTheDisk) {
  const auto folder = fresh_folder("writer");
  for (const auto durability : {Durability::kProcessCrash, Durability::kPowerCut}) {
    const auto path = folder / "a.mcap";
    auto sink = FileSink::create(path, durability);
    ASSERT_TRUE(sink.ok());
    McapWriter writer;
    ASSERT_TRUE(writer.open(std::move(*sink)).ok());
    ASSERT_TRUE(writer.add_channel(Channel{1, 0, "/a", "cdr", {}}).ok());
    const std::string big(3'000'000, 'y');
    ASSERT_TRUE(writer.write(Message{.channel_id = 1, .data = as_bytes(big)}).ok());
    EXPECT_EQ(std::filesystem::file_size(path), writer.size()) << "chunk was not flushed";
    ASSERT_TRUE(writer.close().ok());
    EXPECT_THAT(examine(read_text(path)), IsEmpty());
  }
  EXPECT_EQ(FileSink::create(folder / "none" / "a.mcap").status().code(), StatusCode::kIo);
}

}  // namespace
}  // namespace camvox::storage
