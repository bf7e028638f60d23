/// Files that lie, and files that are cut: a clear error or a correct prefix, never a crash, a hang
/// or memory without bound.
#include <gmock/gmock.h>

#include <random>

#include "camvox/storage/byte_io.hpp"
#include "camvox/storage/doctor.hpp"
#include "camvox/storage/indexed_reader.hpp"
#include "camvox/storage/recover.hpp"
#include "camvox/storage/stream_reader.hpp"
#include "mcap_files.hpp"

namespace camvox::storage {
namespace {

using ::testing::HasSubstr;

McapWriterOptions small_chunks(Compression compression, bool chunked = true) {
  McapWriterOptions options;
  options.compression = compression;
  options.chunked = chunked;
  options.chunk_size = 300;
  return options;
}

std::vector<McapWriterOptions> layouts() {
  return {small_chunks(Compression::kNone),
          small_chunks(Compression::kLz4),
          small_chunks(Compression::kZstd),
          small_chunks(Compression::kNone, false)};
}

struct Streamed {
  std::vector<TestMessage> messages;
  Status status;
  std::uint64_t offset = 0;
  std::size_t problems = 0;
};

Streamed stream(std::string_view file, StreamReaderOptions options = {}) {
  const MemorySource source(as_bytes(file));
  McapStreamReader reader(source, options);
  Streamed result;
  while (const Record* record = reader.next()) {
    if (const auto* message = std::get_if<Message>(record)) {
      result.messages.push_back(copy_of(*message));
    }
  }
  result.status = reader.status();
  result.offset = reader.offset();
  result.problems = reader.problems().size();
  return result;
}

std::pair<RecoverResult, std::string> recovered(std::string_view file) {
  const MemorySource source(as_bytes(file));
  ByteBuffer out;
  auto result = recover(source, std::make_unique<MemorySink>(out));
  return {std::move(result), std::string(as_text(out.view()))};
}

bool is_prefix(const std::vector<TestMessage>& part, const std::vector<TestMessage>& whole) {
  return part.size() <= whole.size() && std::equal(part.begin(), part.end(), whole.begin());
}

TEST(HostileInput, CutAtEveryByteGivesACorrectPrefixEverywhere) {
  const auto messages = make_messages(12, 40);
  for (const auto& options : layouts()) {
    const std::string file = write_file(messages, options);
    std::size_t last_count = 0;
    for (std::size_t size = 0; size < file.size(); ++size) {
      const std::string_view cut = std::string_view(file).substr(0, size);
      const auto streamed = stream(cut);
      EXPECT_FALSE(streamed.status.ok()) << size;
      EXPECT_FALSE(streamed.status.message().empty());
      EXPECT_TRUE(is_prefix(streamed.messages, messages)) << size;
      EXPECT_GE(streamed.messages.size(), last_count) << size;
      last_count = streamed.messages.size();

      const auto [result, copy] = recovered(cut);
      EXPECT_EQ(result.status.ok(), size >= kMagic.size()) << size;
      if (!result.status.ok()) continue;
      const auto again = stream(copy);
      EXPECT_TRUE(again.status.ok()) << size << again.status.message();
      EXPECT_TRUE(is_prefix(again.messages, messages)) << size;
      // Recovery also saves complete messages of the chunk that was cut.
      EXPECT_GE(again.messages.size(), streamed.messages.size()) << size;
      EXPECT_EQ(again.messages.size(), result.statistics.message_count);
      EXPECT_TRUE(result.lost || again.messages.size() == messages.size()) << size;

      const auto reader = McapIndexedReader::open(std::make_unique<MemorySource>(as_bytes(cut)));
      ASSERT_EQ(reader.ok(), size >= kMagic.size());
      EXPECT_EQ((*reader)->summary().statistics.message_count, streamed.messages.size()) << size;
      const MemorySource source(as_bytes(cut));
      EXPECT_TRUE(doctor(source).has_errors()) << size;
    }
    EXPECT_EQ(last_count, messages.size());
  }
}

TEST(HostileInput, CutChunkGivesItsCompleteMessages) {
  auto options = small_chunks(Compression::kNone);
  options.chunk_size = 1 << 20;  // one chunk for all
  const auto messages = make_messages(20, 100);
  const std::string file = write_file(messages, options);
  const auto [result, copy] = recovered(std::string_view(file).substr(0, 1500));
  EXPECT_TRUE(result.lost);
  EXPECT_GT(result.unverified_messages, 8U);
  EXPECT_EQ(result.unverified_messages, result.statistics.message_count);
  EXPECT_TRUE(is_prefix(stream(copy).messages, messages));
}

/// Any flipped bit of a file with all checksums either does not touch the messages or is reported.
TEST(HostileInput, FlippedBitsNeverGiveAWrongMessageInSilence) {
  const auto messages = make_messages(12, 40);
  for (const auto& options : layouts()) {
    const std::string file = write_file(messages, options);
    for (std::size_t bit = 0; bit < file.size() * 8; ++bit) {
      std::string flipped = file;
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
      const auto streamed = stream(flipped);
      const bool clean = streamed.status.ok() && streamed.problems == 0;
      EXPECT_TRUE(!clean || streamed.messages == messages) << "bit " << bit;
      if (bit % 5 == 0) {
        const auto [result, copy] = recovered(flipped);
        EXPECT_TRUE(!result.status.ok() || stream(copy).status.ok()) << "bit " << bit;
        EXPECT_TRUE(!result.status.ok() || result.lost || stream(copy).messages == messages) << bit;
        const MemorySource source(as_bytes(flipped));
        EXPECT_TRUE(doctor(source).has_errors() || streamed.messages == messages) << bit;
      }
    }
  }
}

TEST(HostileInput, ManyFlippedBitsAreSurvived) {
  std::mt19937 random(11);
  for (const auto& options : layouts()) {
    const std::string file = write_file(make_messages(12, 40), options);
    for (int round = 0; round < 2000; ++round) {
      std::string noisy = file;
      for (int i = 0; i < 1 + round % 20; ++i) {
        noisy[random() % noisy.size()] = static_cast<char>(random());
      }
      (void)stream(noisy, {.limits = {}, .verify_crc = false, .skip_bad_chunks = true});
      (void)recovered(noisy);
      const auto reader =
          McapIndexedReader::open(std::make_unique<MemorySource>(as_bytes(noisy)),
                                  {.limits = {}, .verify_crc = false, .skip_bad_chunks = true});
      if (!reader.ok()) continue;
      auto cursor = (*reader)->messages();
      while (cursor.next() != nullptr) EXPECT_FALSE(cursor.channel().topic.empty() && round < 0);
    }
  }
}

/// Every 8-byte field that could be a length, made absurd.
TEST(HostileInput, AbsurdLengthsAreRefusedBeforeAnythingIsAllocated) {
  const std::string file = write_file(make_messages(6, 40), small_chunks(Compression::kZstd));
  for (std::size_t at = kMagic.size(); at + 8 < file.size(); ++at) {
    for (const std::uint64_t length :
         {~0UL, ~0UL >> 1, 1UL << 62, 1UL << 40, 1UL << 31, file.size()}) {
      std::string forged = file;
      std::memcpy(forged.data() + at, &length, sizeof(length));
      (void)stream(forged, {.limits = {.max_record_size = 1 << 16, .max_chunk_size = 1 << 16}});
      (void)recovered(forged);
      const MemorySource source(as_bytes(forged));
      (void)doctor(source).has_errors();
    }
  }
}

TEST(HostileInput, WrongMagicIsSaid) {
  std::string file = write_file(make_messages(2, 10), {});
  std::string wrong_start = file;
  wrong_start[0] = 'M';
  EXPECT_EQ(stream(wrong_start).status.code(), StatusCode::kBadMagic);
  EXPECT_EQ(recovered(wrong_start).first.status.code(), StatusCode::kBadMagic);
  std::string wrong_end = file;
  wrong_end.back() = 'x';
  const auto streamed = stream(wrong_end);
  EXPECT_EQ(streamed.status.code(), StatusCode::kBadMagic);
  EXPECT_EQ(streamed.offset, file.size() - kMagic.size());
  EXPECT_THAT(streamed.status.message(), HasSubstr("closing magic"));
}

/// A file with one chunk of these bytes.
std::string chunk_file(const Chunk& chunk) {
  ByteBuffer out;
  out.append(as_bytes(kMagic));
  encode_record(Header{"ros2", ""}, out);
  encode_record(chunk, out);
  return std::string(as_text(out.view()));
}

TEST(HostileInput, BombIsRefusedByItsDeclaredSizeAndByItsRealSize) {
  ByteBuffer zeros;
  zeros.resize(200U << 20);
  std::memset(zeros.data(), 0, zeros.size());
  for (const auto compression : {Compression::kZstd, Compression::kLz4}) {
    ByteBuffer packed;
    ASSERT_TRUE(Compressor(compression, 0).compress(zeros.view(), packed).ok());
    EXPECT_LT(packed.size(), 1U << 20);
    Chunk chunk;
    chunk.compression = to_string(compression);
    chunk.records = packed.view();
    chunk.uncompressed_size = zeros.size();
    const StreamReaderOptions options{.limits = {.max_chunk_size = 100 << 20}};
    EXPECT_EQ(stream(chunk_file(chunk), options).status.code(), StatusCode::kLimit);
    // Says it is small, is not.
    chunk.uncompressed_size = 1000;
    EXPECT_EQ(stream(chunk_file(chunk), options).status.code(), StatusCode::kCorrupt);
    // Says more than that many bytes can hold: refused without allocating it.
    chunk.records = packed.view().first(100);
    chunk.uncompressed_size = 90U << 20;
    EXPECT_EQ(stream(chunk_file(chunk), options).status.code(), StatusCode::kCorrupt);
  }
}

TEST(HostileInput, UnknownCompressionIsNamed) {
  Chunk chunk;
  chunk.compression = "bz2";
  const auto streamed = stream(chunk_file(chunk));
  EXPECT_EQ(streamed.status.code(), StatusCode::kUnsupported);
  EXPECT_THAT(streamed.status.message(), HasSubstr("bz2"));
}

TEST(HostileInput, RecordOverTheLimitStopsWithItsPlace) {
  const std::string file = write_file(make_messages(2, 5000), {});
  const auto streamed = stream(file, {.limits = {.max_record_size = 1000}});
  EXPECT_EQ(streamed.status.code(), StatusCode::kLimit);
  EXPECT_THAT(streamed.status.message(), HasSubstr("offset"));
}

TEST(HostileInput, ChunkInsideAChunkIsRefused) {
  ByteBuffer inner;
  encode_record(Chunk{}, inner);
  Chunk chunk;
  chunk.records = inner.view();
  chunk.uncompressed_size = inner.size();
  EXPECT_EQ(stream(chunk_file(chunk)).status.code(), StatusCode::kCorrupt);
}

}  // namespace
}  // namespace camvox::storage
