#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "camvox/storage/byte_buffer.hpp"

/// The records of an MCAP file (mcap.dev, "MCAP Format Specification", version 0) as plain structs.
/// Times are nanoseconds since an epoch that the file does not name (Unix by custom), unsigned as
/// in the file. `Bytes` members are views: of the reader's memory, valid until it moves on.
namespace camvox::storage {

inline constexpr std::string_view kMagic{"\x89MCAP0\r\n", 8};

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

using StringMap = std::map<std::string, std::string>;

struct Header {
  std::string profile;
  std::string library;
  friend bool operator==(const Header&, const Header&) = default;
};

/// Last record. Zero offsets mean that the file has no summary, or no summary offsets.
struct Footer {
  std::uint64_t summary_start = 0;
  std::uint64_t summary_offset_start = 0;
  std::uint32_t summary_crc = 0;  ///< 0: not computed.
  friend bool operator==(const Footer&, const Footer&) = default;
};

struct Schema {
  std::uint16_t id = 0;  ///< 0 is not allowed in a file.
  std::string name;      ///< For instance "sensor_msgs/msg/Imu".
  std::string encoding;  ///< For instance "ros2msg".
  std::string data;      ///< Text or bytes, as the encoding says.
  friend bool operator==(const Schema&, const Schema&) = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: no schema.
  std::string topic;
  std::string message_encoding;  ///< For instance "cdr".
  StringMap metadata;
  friend bool operator==(const Channel&, const Channel&) = default;
};

struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;
  std::uint64_t publish_time_ns = 0;
  Bytes data;
};

/// A block of schemas, channels and messages, compressed as one.
struct Chunk {
  std::uint64_t message_start_time_ns = 0;
  std::uint64_t message_end_time_ns = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: not computed.
  std::string compression;             ///< "", "lz4" or "zstd".
  Bytes records;                       ///< Compressed.
};

/// Log time and offset, inside the uncompressed chunk, of each message of one channel.
struct MessageIndex {
  std::uint16_t channel_id = 0;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> records;
  friend bool operator==(const MessageIndex&, const MessageIndex&) = default;
};

struct ChunkIndex {
  std::uint64_t message_start_time_ns = 0;
  std::uint64_t message_end_time_ns = 0;
  std::uint64_t chunk_start_offset = 0;
  std::uint64_t chunk_length = 0;  ///< With the 9 bytes of opcode and length.
  std::vector<std::pair<std::uint16_t, std::uint64_t>> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0;
  std::uint64_t uncompressed_size = 0;
  friend bool operator==(const ChunkIndex&, const ChunkIndex&) = default;
};

struct Attachment {
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::string name;
  std::string media_type;
  Bytes data;
  std::uint32_t crc = 0;  ///< 0: not computed. Set by the writer.
};

struct AttachmentIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;  ///< With the 9 bytes of opcode and length.
  std::uint64_t log_time_ns = 0;
  std::uint64_t create_time_ns = 0;
  std::uint64_t data_size = 0;
  std::string name;
  std::string media_type;
  friend bool operator==(const AttachmentIndex&, const AttachmentIndex&) = default;
};

struct Statistics {
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0;
  std::uint32_t attachment_count = 0;
  std::uint32_t metadata_count = 0;
  std::uint32_t chunk_count = 0;
  std::uint64_t message_start_time_ns = 0;
  std::uint64_t message_end_time_ns = 0;
  std::vector<std::pair<std::uint16_t, std::uint64_t>> channel_message_counts;
  friend bool operator==(const Statistics&, const Statistics&) = default;
};

struct Metadata {
  std::string name;
  StringMap metadata;
  friend bool operator==(const Metadata&, const Metadata&) = default;
};

struct MetadataIndex {
  std::uint64_t offset = 0;
  std::uint64_t length = 0;  ///< With the 9 bytes of opcode and length.
  std::string name;
  friend bool operator==(const MetadataIndex&, const MetadataIndex&) = default;
};

/// Where in the summary the records of one opcode are.
struct SummaryOffset {
  Opcode group_opcode{};
  std::uint64_t group_start = 0;
  std::uint64_t group_length = 0;
  friend bool operator==(const SummaryOffset&, const SummaryOffset&) = default;
};

struct DataEnd {
  std::uint32_t data_section_crc = 0;  ///< 0: not computed.
  friend bool operator==(const DataEnd&, const DataEnd&) = default;
};

/// A record of an opcode that the format does not define (yet, or private ones from 0x80).
struct UnknownRecord {
  std::uint8_t opcode = 0;
  Bytes content;
};

using Record = std::variant<Header,
                            Footer,
                            Schema,
                            Channel,
                            Message,
                            Chunk,
                            MessageIndex,
                            ChunkIndex,
                            Attachment,
                            AttachmentIndex,
                            Statistics,
                            Metadata,
                            MetadataIndex,
                            SummaryOffset,
                            DataEnd,
                            UnknownRecord>;

[[nodiscard]] std::string_view to_string(Opcode opcode);

}  // namespace camvox::storage
