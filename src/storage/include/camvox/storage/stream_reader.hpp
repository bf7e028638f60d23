#pragma once

#include <vector>

#include "camvox/storage/record_reader.hpp"

namespace camvox::storage {

struct StreamReaderOptions {
  ReadLimits limits;
  bool verify_crc = true;
  bool expand_chunks = true;     ///< Give the records in a chunk instead of the chunk.
  bool skip_bad_chunks = false;  ///< Note a damaged chunk in `problems` and go on behind it.
};

/// Gives every record of a file in file order. Needs no summary and no end: a file that is cut off
/// gives all that comes before the cut. Not thread-safe.
class McapStreamReader {
 public:
  /// The source must live as long as the reader.
  explicit McapStreamReader(const Source& source, StreamReaderOptions options = {});

  /// The next record, or nullptr when there is none; then `status` says whether the file ended as
  /// it should (ok) or why and where reading stopped. Views in the record are valid until the next
  /// call.
  [[nodiscard]] const Record* next();

  [[nodiscard]] const Status& status() const { return status_; }

  /// Where the last record is in the file (that of its chunk for a record in a chunk), or where
  /// reading stopped.
  [[nodiscard]] std::uint64_t offset() const { return offset_; }

  /// What was wrong but did not stop the reading: CRC mismatches of attachments, of the data
  /// section and of the summary, and chunks that were skipped.
  [[nodiscard]] const std::vector<FileProblem>& problems() const { return problems_; }

 private:
  const Record* next_in_chunk();
  const Record* next_top_level();
  const Record* stop(Status status);
  [[nodiscard]] bool open_chunk();
  void note(StatusCode code, std::string what);
  void sum(const RawRecord& raw);
  void sum_chunk(Bytes content, const Chunk& chunk);
  void check_crc(const RawRecord& raw);

  StreamReaderOptions options_;
  RecordReader reader_;
  ChunkLoader loader_;
  ByteBuffer chunk_buffer_;
  ChunkRecords chunk_records_{Bytes()};
  bool in_chunk_ = false;
  bool at_end_ = false;
  Record record_;
  Status status_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;        ///< Of the data section, then of the summary.
  std::uint32_t chunk_crc_ = 0;  ///< Of the last chunk, as it is in the file.
  std::uint64_t summary_start_ = 0;
  std::vector<FileProblem> problems_;
};

}  // namespace camvox::storage
