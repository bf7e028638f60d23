#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "camvox/storage/compression.hpp"
#include "camvox/storage/records.hpp"
#include "camvox/storage/sink.hpp"
#include "camvox/storage/status.hpp"

namespace camvox::storage {

/// What McapWriter puts into a file. The defaults are a `ros2 bag` file with all checksums.
struct McapWriterOptions {
  std::string profile = "ros2";
  std::string library = "camvox";
  bool chunked = true;
  std::uint64_t chunk_size = 1024 * 1024;  ///< A chunk is closed once it holds this many bytes.
  Compression compression = Compression::kNone;
  int compression_level = 0;  ///< 0: the default of the compression library.
  bool chunk_crc = true;
  bool attachment_crc = true;
  bool data_crc = true;
  bool summary_crc = true;
  bool message_index = true;
  bool chunk_index = true;
  bool attachment_index = true;
  bool metadata_index = true;
  bool statistics = true;
  bool repeat_schemas = true;
  bool repeat_channels = true;
  bool summary_offsets = true;
};

/// Writes one MCAP file. After each chunk the sink is flushed, so that a crash loses the open chunk
/// and `recover` gets the rest back. The first error (a full disk, say) is returned by that call
/// and by all later ones. Same calls, same bytes. Not thread-safe.
class McapWriter {
 public:
  explicit McapWriter(McapWriterOptions options = {});
  /// Does not close: a writer that was not closed leaves a file without summary.
  ~McapWriter();
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Starts the file: magic and header.
  Status open(std::unique_ptr<Sink> sink);

  /// Announces a schema and gives its id, the one from before for an equal schema. It is written
  /// with the first message that needs it, or at close.
  Result<std::uint16_t> add_schema(std::string name, std::string encoding, std::string data);
  Result<std::uint16_t> add_channel(std::uint16_t schema_id,
                                    std::string topic,
                                    std::string message_encoding,
                                    StringMap metadata = {});

  /// The same with ids that the caller chose. Saying it twice is fine, saying two things is not.
  Status add_schema(const Schema& schema);
  Status add_channel(const Channel& channel);

  /// kInvalid (and the writer goes on) when the channel is not known or the message too long.
  Status write(const Message& message);
  Status write(const Attachment& attachment);
  Status write(const Metadata& metadata);

  /// Closes the open chunk, if any message is in it, and flushes the sink.
  Status flush();

  /// Writes the summary and closes the sink. Without it the file is readable, but slow to open.
  Status close();

  /// What is in the sink, plus the open chunk before compression.
  [[nodiscard]] std::uint64_t size() const { return offset_ + chunk_.size(); }
  /// Messages, times and counts so far.
  [[nodiscard]] Statistics statistics() const;
  [[nodiscard]] const Status& status() const { return status_; }

 private:
  struct SchemaEntry {
    Schema schema;
    bool written = false;
  };
  struct ChannelEntry {
    Channel channel;
    bool written = false;
    std::uint64_t message_count = 0;
    MessageIndex index;  ///< Of the open chunk.
  };

  Status put(std::span<const Bytes> parts);
  Status put_with_crc(std::span<const Bytes> parts);
  void write_definitions(ChannelEntry& entry, ByteBuffer& out);
  Status write_chunked(const Message& message, ChannelEntry& entry);
  Status write_unchunked(const Message& message, ChannelEntry& entry);
  Status finish_chunk(Bytes tail = {});
  ChunkIndex encode_chunk_frame(std::uint64_t uncompressed_size,
                                std::uint64_t compressed_size,
                                std::uint32_t crc);
  void count(const Message& message, ChannelEntry& entry);
  void encode_message_indexes(ChunkIndex& index, std::uint64_t start, ByteBuffer& out);
  Status write_unused_definitions();
  void encode_summary(ByteBuffer& out) const;

  McapWriterOptions options_;
  std::unique_ptr<Sink> sink_;
  Status status_;
  std::uint64_t offset_ = 0;
  std::uint32_t data_crc_ = 0;

  std::map<std::uint16_t, SchemaEntry> schemas_;
  std::map<std::uint16_t, ChannelEntry> channels_;
  Statistics statistics_;
  std::vector<ChunkIndex> chunk_indexes_;
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;

  Compressor compressor_;
  ByteBuffer chunk_;  ///< Records of the open chunk.
  std::uint64_t chunk_message_count_ = 0;
  std::uint64_t chunk_start_time_ns_ = 0;
  std::uint64_t chunk_end_time_ns_ = 0;
  ByteBuffer compressed_;
  ByteBuffer scratch_;
};

}  // namespace camvox::storage
