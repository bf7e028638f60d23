#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "camvox/storage/bag_metadata.hpp"
#include "camvox/storage/bag_writer.hpp"
#include "camvox/storage/indexed_reader.hpp"

namespace camvox::storage {

/// A message of a bag.
struct BagMessage {
  std::size_t topic = 0;  ///< Number in BagReader::topics.
  std::int64_t log_time_ns = 0;
  std::int64_t publish_time_ns = 0;
  std::uint32_t sequence = 0;
  Bytes data;  ///< Valid until the cursor moves on.
};

class BagCursor;

/// Reads a bag: a folder with metadata.yaml, a folder with only MCAP files, or one MCAP file. What
/// it says about the bag is taken from the files themselves, not from metadata.yaml, which only
/// tells which files belong to it.
class BagReader {
 public:
  static Result<std::unique_ptr<BagReader>> open(const std::filesystem::path& path,
                                                 IndexedReaderOptions options = {});

  /// In the order in which the files first define them.
  [[nodiscard]] const std::vector<BagTopic>& topics() const { return topics_; }
  [[nodiscard]] std::uint64_t message_count() const { return message_count_; }
  /// Log times of the first and the last message; 0 for an empty bag.
  [[nodiscard]] std::int64_t start_time_ns() const { return start_time_ns_; }
  [[nodiscard]] std::int64_t end_time_ns() const { return end_time_ns_; }
  [[nodiscard]] std::uint64_t size() const;
  [[nodiscard]] const std::vector<std::filesystem::path>& files() const { return files_; }
  /// The file of the same number.
  [[nodiscard]] const McapIndexedReader& file(std::size_t number) const {
    return *readers_[number];
  }
  /// From metadata.yaml, or from the last `rosbag2` record, or made from the files.
  [[nodiscard]] const BagMetadata& metadata() const { return metadata_; }
  /// What was wrong with the files but did not keep them from being read.
  [[nodiscard]] const std::vector<FileProblem>& problems() const { return problems_; }

  /// Messages of all files in order of their log time. The reader must outlive the cursor.
  [[nodiscard]] BagCursor messages(const MessageFilter& filter = {}) const;

  /// Number in `topics` of a channel of a file.
  [[nodiscard]] std::size_t topic_of(std::size_t file, std::uint16_t channel_id) const;

 private:
  BagReader() = default;
  Status add_file(const std::filesystem::path& path, const IndexedReaderOptions& options);
  void add_topics(const Summary& summary);
  void finish_metadata(bool from_file);

  std::vector<std::filesystem::path> files_;
  std::vector<std::unique_ptr<McapIndexedReader>> readers_;
  std::vector<std::map<std::uint16_t, std::size_t>> topic_numbers_;  ///< By file and channel.
  std::vector<BagTopic> topics_;
  BagMetadata metadata_;
  std::vector<FileProblem> problems_;
  std::uint64_t message_count_ = 0;
  std::int64_t start_time_ns_ = 0;
  std::int64_t end_time_ns_ = 0;
};

/// Walks through the messages of a bag.
class BagCursor {
 public:
  BagCursor(const BagReader& reader, MessageFilter filter);

  /// The next message, or nullptr: at the end (status ok), or on an error.
  [[nodiscard]] const BagMessage* next();
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  struct OpenFile {
    std::size_t number;
    std::unique_ptr<MessageCursor> cursor;  ///< Stays in place: `message` points into it.
    const Message* message;
  };

  [[nodiscard]] bool open_due_files();
  bool advance(OpenFile& file);

  const BagReader* reader_;
  MessageFilter filter_;
  std::vector<std::size_t> order_;  ///< Files by start time.
  std::size_t next_file_ = 0;
  std::vector<OpenFile> open_;
  std::optional<std::size_t> last_;  ///< In `open_`: whose message was given out.
  BagMessage message_;
  Status status_;
};

}  // namespace camvox::storage
