#pragma once

#include <cstdint>
#include <optional>

#include "camvox/storage/compression.hpp"
#include "camvox/storage/limits.hpp"
#include "camvox/storage/record_codec.hpp"
#include "camvox/storage/source.hpp"

namespace camvox::storage {

/// A record that was delimited but not decoded.
struct RawRecord {
  std::uint8_t opcode = 0;
  std::uint64_t offset = 0;  ///< Of the opcode, in the file or in the uncompressed chunk.
  Bytes content;

  [[nodiscard]] bool is(Opcode wanted) const { return Opcode{opcode} == wanted; }
  [[nodiscard]] std::uint64_t end() const { return offset + kRecordHeadSize + content.size(); }
};

/// Something wrong at a place of a file, and what became of it.
struct FileProblem {
  std::uint64_t offset = 0;
  Status status;
};

/// Opening magic: kBadMagic when it is not there.
Status check_magic(const Source& source);

/// Delimits the top-level records of a file, front to back.
class RecordReader {
 public:
  /// Starts behind the magic, which `check_magic` looks at.
  RecordReader(const Source& source, const ReadLimits& limits);

  /// The next record, or false: at the end of the file (status ok, behind footer and magic) or
  /// where it cannot go on (status says why, `offset` where). The record's content is valid until
  /// the next call.
  [[nodiscard]] bool next(RawRecord& record);

  /// Continues at another place, for instance behind a bad record.
  void seek(std::uint64_t offset);

  [[nodiscard]] const Status& status() const { return status_; }
  /// Of the next record.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }

 private:
  bool stop(StatusCode code, const std::string& what);
  bool check_closing_magic();

  SourceWindow window_;
  ReadLimits limits_;
  std::uint64_t offset_;
  bool behind_footer_ = false;
  Status status_;
};

/// Delimits the records inside an uncompressed chunk.
class ChunkRecords {
 public:
  explicit ChunkRecords(Bytes records) : records_(records) {}

  /// False at the end, and where a record does not fit; `complete` tells which.
  [[nodiscard]] bool next(RawRecord& record);
  [[nodiscard]] bool complete() const { return position_ == records_.size(); }
  [[nodiscard]] std::size_t position() const { return position_; }

 private:
  Bytes records_;
  std::size_t position_ = 0;
};

/// Decompresses chunks and checks their CRC.
class ChunkLoader {
 public:
  ChunkLoader(const ReadLimits& limits, bool verify_crc)
      : limits_(limits), verify_crc_(verify_crc) {}

  /// The records of the chunk: in place when it is not compressed, else in `buffer`. A caller that
  /// has the CRC of the bytes in the file passes it: it serves a chunk that is not compressed.
  Result<Bytes> load(const Chunk& chunk,
                     ByteBuffer& buffer,
                     std::optional<std::uint32_t> crc_in_file = std::nullopt);

  /// What is left of the records of a chunk that was cut off; never fails.
  Bytes load_prefix(const Chunk& chunk, ByteBuffer& buffer);

 private:
  Decompressor decompressor_;
  ReadLimits limits_;
  bool verify_crc_;
};

}  // namespace camvox::storage
