#include "camvox/storage/writer.hpp"

#include <array>
#include <limits>

#include "camvox/storage/byte_io.hpp"
#include "camvox/storage/crc.hpp"
#include "camvox/storage/limits.hpp"
#include "camvox/storage/record_codec.hpp"

namespace camvox::storage {
namespace {

/// From this size on a message is handed to the sink where it is, not copied into the chunk.
constexpr std::size_t kNoCopySize = 64 * 1024;

std::uint64_t total_size(std::span<const Bytes> parts) {
  std::uint64_t size = 0;
  for (const Bytes part : parts) size += part.size();
  return size;
}

Status invalid(std::string message) { return {StatusCode::kInvalid, std::move(message)}; }

/// The smallest id that is free, from 1 on; 0 when all are taken.
template <typename Map>
std::uint16_t free_id(const Map& map) {
  if (map.empty()) return 1;
  const std::uint16_t last = map.rbegin()->first;
  if (last < std::numeric_limits<std::uint16_t>::max()) return static_cast<std::uint16_t>(last + 1);
  for (std::uint16_t id = 1; id != 0; ++id) {
    if (!map.contains(id)) return id;
  }
  return 0;
}

}  // namespace

McapWriter::McapWriter(McapWriterOptions options)
    : options_(std::move(options)),
      status_(invalid("the writer is not open")),
      compressor_(options_.compression, options_.compression_level) {}

McapWriter::~McapWriter() = default;

Status McapWriter::open(std::unique_ptr<Sink> sink) {
  if (sink_) return invalid("the writer is open already; use one writer for one file");
  sink_ = std::move(sink);
  status_ = {};
  scratch_.clear();
  scratch_.append(as_bytes(kMagic));
  encode_record(Header{options_.profile, options_.library}, scratch_);
  const std::array parts = {scratch_.view()};
  return put_with_crc(parts);
}

Status McapWriter::put(std::span<const Bytes> parts) {
  status_ = sink_->write(parts);
  if (status_.ok()) offset_ += total_size(parts);
  return status_;
}

Status McapWriter::put_with_crc(std::span<const Bytes> parts) {
  if (options_.data_crc) {
    for (const Bytes part : parts) data_crc_ = crc32(part, data_crc_);
  }
  return put(parts);
}

Result<std::uint16_t> McapWriter::add_schema(std::string name,
                                             std::string encoding,
                                             std::string data) {
  Schema schema{0, std::move(name), std::move(encoding), std::move(data)};
  for (const auto& [id, entry] : schemas_) {
    schema.id = id;
    if (entry.schema == schema) return id;
  }
  schema.id = free_id(schemas_);
  if (auto status = add_schema(schema); !status.ok()) return status;
  return schema.id;
}

Result<std::uint16_t> McapWriter::add_channel(std::uint16_t schema_id,
                                              std::string topic,
                                              std::string message_encoding,
                                              StringMap metadata) {
  Channel channel{0, schema_id, std::move(topic), std::move(message_encoding), std::move(metadata)};
  for (const auto& [id, entry] : channels_) {
    channel.id = id;
    if (entry.channel == channel) return id;
  }
  channel.id = free_id(channels_);
  if (channel.id == 0) return invalid("channel " + channel.topic + ": all 65535 ids are taken");
  if (auto status = add_channel(channel); !status.ok()) return status;
  return channel.id;
}

Status McapWriter::add_schema(const Schema& schema) {
  if (schema.id == 0) return invalid("schema " + schema.name + ": id 0 means 'no schema'");
  const auto [it, is_new] = schemas_.try_emplace(schema.id, SchemaEntry{schema});
  if (!is_new && !(it->second.schema == schema)) {
    return invalid("schema id " + std::to_string(schema.id) + " is " + it->second.schema.name +
                   " already, cannot be " + schema.name);
  }
  return {};
}

Status McapWriter::add_channel(const Channel& channel) {
  if (channel.schema_id != 0 && !schemas_.contains(channel.schema_id)) {
    return invalid("channel " + channel.topic + ": schema id " + std::to_string(channel.schema_id) +
                   " was not added");
  }
  const auto [it, is_new] =
      channels_.try_emplace(channel.id, ChannelEntry{channel, false, 0, {channel.id, {}}});
  if (!is_new && !(it->second.channel == channel)) {
    return invalid("channel id " + std::to_string(channel.id) + " is " + it->second.channel.topic +
                   " already, cannot be " + channel.topic);
  }
  return {};
}

Status McapWriter::write(const Message& message) {
  if (!status_.ok()) return status_;
  const auto it = channels_.find(message.channel_id);
  if (it == channels_.end()) {
    return invalid("message on channel id " + std::to_string(message.channel_id) +
                   ", which was not added");
  }
  if (message.data.size() > kMaxMessageSize) {
    return invalid("message of " + std::to_string(message.data.size()) + " bytes on " +
                   it->second.channel.topic + "; at most " + std::to_string(kMaxMessageSize) +
                   " can be read back");
  }
  return options_.chunked ? write_chunked(message, it->second)
                          : write_unchunked(message, it->second);
}

void McapWriter::write_definitions(ChannelEntry& entry, ByteBuffer& out) {
  if (entry.written) return;
  if (const auto it = schemas_.find(entry.channel.schema_id);
      it != schemas_.end() && !it->second.written) {
    encode_record(it->second.schema, out);
    it->second.written = true;
    ++statistics_.schema_count;
  }
  encode_record(entry.channel, out);
  entry.written = true;
  ++statistics_.channel_count;
}

void McapWriter::count(const Message& message, ChannelEntry& entry) {
  auto& s = statistics_;
  const std::uint64_t time_ns = message.log_time_ns;
  s.message_start_time_ns =
      s.message_count == 0 ? time_ns : std::min(s.message_start_time_ns, time_ns);
  s.message_end_time_ns = std::max(s.message_end_time_ns, time_ns);
  ++s.message_count;
  ++entry.message_count;
}

Status McapWriter::write_chunked(const Message& message, ChannelEntry& entry) {
  if (chunk_.size() + message.data.size() > kMaxMessageSize) {
    if (auto status = finish_chunk(); !status.ok()) return status;
  }
  write_definitions(entry, chunk_);
  const std::uint64_t time_ns = message.log_time_ns;
  chunk_start_time_ns_ =
      chunk_message_count_ == 0 ? time_ns : std::min(chunk_start_time_ns_, time_ns);
  chunk_end_time_ns_ = chunk_message_count_ == 0 ? time_ns : std::max(chunk_end_time_ns_, time_ns);
  ++chunk_message_count_;
  if (options_.message_index) entry.index.records.emplace_back(time_ns, chunk_.size());
  count(message, entry);
  encode_message_head(message, chunk_);
  const bool full = chunk_.size() + message.data.size() >= options_.chunk_size;
  if (full && options_.compression == Compression::kNone && message.data.size() >= kNoCopySize) {
    return finish_chunk(message.data);
  }
  chunk_.append(message.data);
  return full ? finish_chunk() : Status();
}

Status McapWriter::write_unchunked(const Message& message, ChannelEntry& entry) {
  scratch_.clear();
  write_definitions(entry, scratch_);
  encode_message_head(message, scratch_);
  count(message, entry);
  const std::array parts = {scratch_.view(), message.data};
  return put_with_crc(parts);
}

void McapWriter::encode_message_indexes(ChunkIndex& index, std::uint64_t start, ByteBuffer& out) {
  const std::size_t begin = out.size();
  for (auto& [id, entry] : channels_) {
    if (entry.index.records.empty()) continue;
    index.message_index_offsets.emplace_back(id, start + out.size() - begin);
    encode_record(entry.index, out);
    entry.index.records.clear();
  }
  index.message_index_length = out.size() - begin;
}

Status McapWriter::finish_chunk(Bytes tail) {
  if (chunk_message_count_ == 0) return {};
  const bool compressed = options_.compression != Compression::kNone;
  const std::uint32_t crc = options_.chunk_crc ? crc32(tail, crc32(chunk_.view())) : 0;
  if (compressed) {
    status_ = compressor_.compress(chunk_.view(), compressed_);
    if (!status_.ok()) return status_;
  }
  std::array<Bytes, 4> parts = {
      Bytes(), compressed ? compressed_.view() : chunk_.view(), tail, Bytes()};
  const std::uint64_t compressed_size = parts[1].size() + parts[2].size();

  scratch_.clear();
  ChunkIndex index = encode_chunk_frame(chunk_.size() + tail.size(), compressed_size, crc);
  const auto head_size = static_cast<std::size_t>(index.chunk_length - compressed_size);
  parts[0] = scratch_.view().first(head_size);
  parts[3] = scratch_.view().subspan(head_size);
  if (options_.data_crc) {
    data_crc_ = crc32(parts[0], data_crc_);
    // The bytes of an uncompressed chunk were summed above: no need to touch them again.
    data_crc_ = !compressed && options_.chunk_crc ? crc32_combine(data_crc_, crc, compressed_size)
                                                  : crc32(parts[2], crc32(parts[1], data_crc_));
    data_crc_ = crc32(parts[3], data_crc_);
  }
  if (auto status = put(parts); !status.ok()) return status;
  ++statistics_.chunk_count;
  chunk_indexes_.push_back(std::move(index));
  chunk_.clear();
  chunk_message_count_ = 0;
  status_ = sink_->flush();
  return status_;
}

/// What goes before and after the bytes of the open chunk (its head, its message indexes), into the
/// scratch buffer; returns its chunk index.
ChunkIndex McapWriter::encode_chunk_frame(std::uint64_t uncompressed_size,
                                          std::uint64_t compressed_size,
                                          std::uint32_t crc) {
  const Chunk head{chunk_start_time_ns_,
                   chunk_end_time_ns_,
                   uncompressed_size,
                   crc,
                   std::string(to_string(options_.compression)),
                   {}};
  encode_chunk_head(head, compressed_size, scratch_);
  ChunkIndex index{.message_start_time_ns = chunk_start_time_ns_,
                   .message_end_time_ns = chunk_end_time_ns_,
                   .chunk_start_offset = offset_,
                   .chunk_length = scratch_.size() + compressed_size,
                   .message_index_offsets = {},
                   .message_index_length = 0,
                   .compression = head.compression,
                   .compressed_size = compressed_size,
                   .uncompressed_size = uncompressed_size};
  encode_message_indexes(index, offset_ + index.chunk_length, scratch_);
  return index;
}

Status McapWriter::write(const Attachment& attachment) {
  if (auto status = flush(); !status.ok()) return status;
  scratch_.clear();
  encode_attachment_head(attachment, scratch_);
  const std::size_t head_size = scratch_.size();
  std::uint32_t crc = 0;
  if (options_.attachment_crc) {
    crc = crc32(attachment.data, crc32(scratch_.view().subspan(kRecordHeadSize)));
  }
  ByteWriter(scratch_).number(crc);
  const std::array parts = {
      scratch_.view().first(head_size), attachment.data, scratch_.view().subspan(head_size)};
  attachment_indexes_.push_back({offset_,
                                 total_size(parts),
                                 attachment.log_time_ns,
                                 attachment.create_time_ns,
                                 attachment.data.size(),
                                 attachment.name,
                                 attachment.media_type});
  ++statistics_.attachment_count;
  return put_with_crc(parts);
}

Status McapWriter::write(const Metadata& metadata) {
  if (auto status = flush(); !status.ok()) return status;
  scratch_.clear();
  encode_record(metadata, scratch_);
  metadata_indexes_.push_back({offset_, scratch_.size(), metadata.name});
  ++statistics_.metadata_count;
  const std::array parts = {scratch_.view()};
  return put_with_crc(parts);
}

Status McapWriter::flush() {
  if (!status_.ok()) return status_;
  return finish_chunk();
}

Status McapWriter::write_unused_definitions() {
  scratch_.clear();
  for (auto& [id, entry] : schemas_) {
    if (entry.written) continue;
    encode_record(entry.schema, scratch_);
    entry.written = true;
    ++statistics_.schema_count;
  }
  for (auto& [id, entry] : channels_) write_definitions(entry, scratch_);
  const std::array parts = {scratch_.view()};
  return scratch_.empty() ? Status() : put_with_crc(parts);
}

Statistics McapWriter::statistics() const {
  Statistics result = statistics_;
  for (const auto& [id, entry] : channels_) {
    if (entry.message_count > 0) {
      result.channel_message_counts.emplace_back(id, entry.message_count);
    }
  }
  return result;
}

/// Groups of one opcode each, then their offsets, then the footer, all of which the CRC covers.
void McapWriter::encode_summary(ByteBuffer& out) const {
  const std::uint64_t base = offset_;
  std::vector<SummaryOffset> offsets;
  const auto group = [&](Opcode opcode, bool enabled, const auto& encode_all) {
    const std::size_t start = out.size();
    if (enabled) encode_all();
    if (out.size() > start) offsets.push_back({opcode, base + start, out.size() - start});
  };
  const auto encode_list = [&out](const auto& list) {
    return [&] {
      for (const auto& record : list) encode_record(record, out);
    };
  };
  group(Opcode::kSchema, options_.repeat_schemas, [&] {
    for (const auto& [id, entry] : schemas_) encode_record(entry.schema, out);
  });
  group(Opcode::kChannel, options_.repeat_channels, [&] {
    for (const auto& [id, entry] : channels_) encode_record(entry.channel, out);
  });
  group(Opcode::kStatistics, options_.statistics, [&] { encode_record(statistics(), out); });
  group(Opcode::kChunkIndex, options_.chunk_index, encode_list(chunk_indexes_));
  group(Opcode::kAttachmentIndex, options_.attachment_index, encode_list(attachment_indexes_));
  group(Opcode::kMetadataIndex, options_.metadata_index, encode_list(metadata_indexes_));

  Footer footer;
  footer.summary_start = out.empty() ? 0 : base;
  if (options_.summary_offsets && !offsets.empty()) {
    footer.summary_offset_start = base + out.size();
    encode_list(offsets)();
  }
  encode_record(footer, out);
  out.resize(out.size() - sizeof(footer.summary_crc));
  ByteWriter(out).number(options_.summary_crc ? crc32(out.view()) : std::uint32_t{0});
}

Status McapWriter::close() {
  if (auto status = flush(); !status.ok()) return status;
  if (auto status = write_unused_definitions(); !status.ok()) return status;
  scratch_.clear();
  encode_record(DataEnd{data_crc_}, scratch_);
  const std::array data_end = {scratch_.view()};
  if (auto status = put(data_end); !status.ok()) return status;
  ByteBuffer summary;
  encode_summary(summary);
  const std::array parts = {summary.view(), as_bytes(kMagic)};
  if (auto status = put(parts); !status.ok()) return status;
  const Status closed = sink_->close();
  status_ = closed.ok() ? invalid("the writer is closed") : closed;
  return closed;
}

}  // namespace camvox::storage
