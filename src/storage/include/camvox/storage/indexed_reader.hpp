#pragma once

#include <deque>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "camvox/storage/summary.hpp"

namespace camvox::storage {

struct IndexedReaderOptions {
  ReadLimits limits;
  bool verify_crc = true;        ///< Check the CRC of each chunk that is read.
  bool skip_bad_chunks = false;  ///< Note a damaged chunk in `problems` and go on without it.
  /// Memory for chunks that overlap in time. Beyond it chunks are read again when their turn comes:
  /// slower, same result.
  std::uint64_t cache_size = 512ULL << 20;
};

/// Which messages to read. The default is all.
struct MessageFilter {
  std::uint64_t start_time_ns = 0;                                        ///< First log time.
  std::uint64_t end_time_ns = std::numeric_limits<std::uint64_t>::max();  ///< Last log time.
  std::vector<std::string> topics;                                        ///< Empty: all topics.
};

class MessageCursor;

/// Gives the messages of a file in order of their log time, whatever their order in the file, and
/// finds a time without reading what comes before. A file without a usable summary is scanned once
/// when it is opened. Cursors may be used from different threads, each from one.
class McapIndexedReader {
 public:
  static Result<std::unique_ptr<McapIndexedReader>> open(std::unique_ptr<Source> source,
                                                         IndexedReaderOptions options = {});
  static Result<std::unique_ptr<McapIndexedReader>> open(const std::filesystem::path& path,
                                                         IndexedReaderOptions options = {});

  [[nodiscard]] const Summary& summary() const { return summary_; }
  [[nodiscard]] const Source& source() const { return *source_; }
  [[nodiscard]] const IndexedReaderOptions& options() const { return options_; }

  /// The reader must outlive the cursor.
  [[nodiscard]] MessageCursor messages(MessageFilter filter = {}) const;

  Result<Metadata> metadata(const MetadataIndex& index) const;
  /// The last metadata record of the name.
  Result<Metadata> metadata(const std::string& name) const;
  /// The attachment's data are a view into `scratch` or the source. Its CRC is checked.
  Result<Attachment> attachment(const AttachmentIndex& index, ByteBuffer& scratch) const;

 private:
  McapIndexedReader(std::unique_ptr<Source> source, IndexedReaderOptions options, Summary summary);
  Result<Record> record_at(std::uint64_t offset, std::uint64_t length, ByteBuffer& scratch) const;

  std::unique_ptr<Source> source_;
  IndexedReaderOptions options_;
  Summary summary_;
};

/// Walks through messages in order of (log time, place in the file).
class MessageCursor {
 public:
  MessageCursor(const McapIndexedReader& reader, MessageFilter filter);

  /// The next message, or nullptr: at the end (status ok), or on an error. Valid until the next
  /// call.
  [[nodiscard]] const Message* next();

  /// The channel of the last message.
  [[nodiscard]] const Channel& channel() const { return *channel_; }

  [[nodiscard]] const Status& status() const { return status_; }
  /// Chunks that were skipped.
  [[nodiscard]] const std::vector<FileProblem>& problems() const { return problems_; }

 private:
  struct Entry {
    std::uint64_t log_time_ns;
    std::uint64_t offset;  ///< Of the record in the uncompressed chunk, or in the file.
  };
  /// A chunk whose time has come, or all loose messages.
  struct Run {
    const ChunkIndex* index = nullptr;  ///< None: loose messages.
    std::vector<Entry> entries;         ///< In order of time.
    std::size_t position = 0;
    ByteBuffer raw;
    ByteBuffer decompressed;
    Bytes records;  ///< Empty while the chunk is not in memory.
    [[nodiscard]] std::uint64_t memory() const { return raw.capacity() + decompressed.capacity(); }
  };

  void select_channels();
  void select_chunks();
  void add_loose_messages();
  [[nodiscard]] bool wanted(const ChunkIndex& index) const;
  [[nodiscard]] bool wanted(const Message& message) const;
  [[nodiscard]] bool wanted(std::uint16_t channel_id) const;
  [[nodiscard]] bool open_due_chunks();
  Status open_chunk(const ChunkIndex& index);
  Status load(Run& run);
  Status list_entries(Run& run) const;
  void make_room(const Run& keep);
  Result<Bytes> message_content(Run& run, std::uint64_t offset);
  void push(std::unique_ptr<Run> run);
  std::unique_ptr<Run> pop();
  [[nodiscard]] static bool later(const std::unique_ptr<Run>& a, const std::unique_ptr<Run>& b);

  const McapIndexedReader* reader_;
  MessageFilter filter_;
  std::vector<const Channel*> channels_;   ///< By id; nullptr for those not wanted.
  std::vector<const ChunkIndex*> chunks_;  ///< To come, in order of start time.
  std::size_t next_chunk_ = 0;
  std::vector<std::unique_ptr<Run>> runs_;  ///< Heap, that of the earliest message on top.
  std::vector<std::unique_ptr<Run>> spare_;
  std::uint64_t pending_ = 0;
  ChunkLoader loader_;
  SourceWindow window_;
  Message message_;
  const Channel* channel_ = nullptr;
  Status status_;
  std::vector<FileProblem> problems_;
};

}  // namespace camvox::storage
