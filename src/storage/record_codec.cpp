#include "camvox/storage/record_codec.hpp"

#include "camvox/storage/byte_io.hpp"

namespace camvox::storage {
namespace {

void read(ByteReader& in, Header& r) {
  r.profile = in.string();
  r.library = in.string();
}

void read(ByteReader& in, Footer& r) {
  r.summary_start = in.number<std::uint64_t>();
  r.summary_offset_start = in.number<std::uint64_t>();
  r.summary_crc = in.number<std::uint32_t>();
}

void read(ByteReader& in, Schema& r) {
  r.id = in.number<std::uint16_t>();
  r.name = in.string();
  r.encoding = in.string();
  r.data = in.string();
}

void read(ByteReader& in, Channel& r) {
  r.id = in.number<std::uint16_t>();
  r.schema_id = in.number<std::uint16_t>();
  r.topic = in.string();
  r.message_encoding = in.string();
  r.metadata = in.string_map();
}

void read(ByteReader& in, Message& r) {
  r.channel_id = in.number<std::uint16_t>();
  r.sequence = in.number<std::uint32_t>();
  r.log_time_ns = in.number<std::uint64_t>();
  r.publish_time_ns = in.number<std::uint64_t>();
  r.data = in.rest();
}

void read_fields_before_data(ByteReader& in, Chunk& r) {
  r.message_start_time_ns = in.number<std::uint64_t>();
  r.message_end_time_ns = in.number<std::uint64_t>();
  r.uncompressed_size = in.number<std::uint64_t>();
  r.uncompressed_crc = in.number<std::uint32_t>();
  r.compression = in.string();
}

void read(ByteReader& in, Chunk& r) {
  read_fields_before_data(in, r);
  r.records = in.bytes64();
}

void read(ByteReader& in, MessageIndex& r) {
  r.channel_id = in.number<std::uint16_t>();
  r.records = in.pairs<std::uint64_t, std::uint64_t>();
}

void read(ByteReader& in, ChunkIndex& r) {
  r.message_start_time_ns = in.number<std::uint64_t>();
  r.message_end_time_ns = in.number<std::uint64_t>();
  r.chunk_start_offset = in.number<std::uint64_t>();
  r.chunk_length = in.number<std::uint64_t>();
  r.message_index_offsets = in.pairs<std::uint16_t, std::uint64_t>();
  r.message_index_length = in.number<std::uint64_t>();
  r.compression = in.string();
  r.compressed_size = in.number<std::uint64_t>();
  r.uncompressed_size = in.number<std::uint64_t>();
}

void read(ByteReader& in, Attachment& r) {
  r.log_time_ns = in.number<std::uint64_t>();
  r.create_time_ns = in.number<std::uint64_t>();
  r.name = in.string();
  r.media_type = in.string();
  r.data = in.bytes64();
  r.crc = in.number<std::uint32_t>();
}

void read(ByteReader& in, AttachmentIndex& r) {
  r.offset = in.number<std::uint64_t>();
  r.length = in.number<std::uint64_t>();
  r.log_time_ns = in.number<std::uint64_t>();
  r.create_time_ns = in.number<std::uint64_t>();
  r.data_size = in.number<std::uint64_t>();
  r.name = in.string();
  r.media_type = in.string();
}

void read(ByteReader& in, Statistics& r) {
  r.message_count = in.number<std::uint64_t>();
  r.schema_count = in.number<std::uint16_t>();
  r.channel_count = in.number<std::uint32_t>();
  r.attachment_count = in.number<std::uint32_t>();
  r.metadata_count = in.number<std::uint32_t>();
  r.chunk_count = in.number<std::uint32_t>();
  r.message_start_time_ns = in.number<std::uint64_t>();
  r.message_end_time_ns = in.number<std::uint64_t>();
  r.channel_message_counts = in.pairs<std::uint16_t, std::uint64_t>();
}

void read(ByteReader& in, Metadata& r) {
  r.name = in.string();
  r.metadata = in.string_map();
}

void read(ByteReader& in, MetadataIndex& r) {
  r.offset = in.number<std::uint64_t>();
  r.length = in.number<std::uint64_t>();
  r.name = in.string();
}

void read(ByteReader& in, SummaryOffset& r) {
  r.group_opcode = static_cast<Opcode>(in.number<std::uint8_t>());
  r.group_start = in.number<std::uint64_t>();
  r.group_length = in.number<std::uint64_t>();
}

void read(ByteReader& in, DataEnd& r) { r.data_section_crc = in.number<std::uint32_t>(); }

template <typename T>
std::optional<Record> decode_as(Bytes content) {
  T record;
  ByteReader in(content);
  read(in, record);
  if (!in.ok()) return std::nullopt;
  return Record(std::move(record));
}

void write(ByteWriter& out, const Header& r) {
  out.string(r.profile);
  out.string(r.library);
}

void write(ByteWriter& out, const Footer& r) {
  out.number(r.summary_start);
  out.number(r.summary_offset_start);
  out.number(r.summary_crc);
}

void write(ByteWriter& out, const Schema& r) {
  out.number(r.id);
  out.string(r.name);
  out.string(r.encoding);
  out.string(r.data);
}

void write(ByteWriter& out, const Channel& r) {
  out.number(r.id);
  out.number(r.schema_id);
  out.string(r.topic);
  out.string(r.message_encoding);
  out.string_map(r.metadata);
}

void write_fields_before_data(ByteWriter& out, const Message& r) {
  out.number(r.channel_id);
  out.number(r.sequence);
  out.number(r.log_time_ns);
  out.number(r.publish_time_ns);
}

void write(ByteWriter& out, const Message& r) {
  write_fields_before_data(out, r);
  out.bytes(r.data);
}

void write_fields_before_data(ByteWriter& out, const Chunk& r) {
  out.number(r.message_start_time_ns);
  out.number(r.message_end_time_ns);
  out.number(r.uncompressed_size);
  out.number(r.uncompressed_crc);
  out.string(r.compression);
}

void write(ByteWriter& out, const Chunk& r) {
  write_fields_before_data(out, r);
  out.number(std::uint64_t{r.records.size()});
  out.bytes(r.records);
}

void write(ByteWriter& out, const MessageIndex& r) {
  out.number(r.channel_id);
  out.pairs(r.records);
}

void write(ByteWriter& out, const ChunkIndex& r) {
  out.number(r.message_start_time_ns);
  out.number(r.message_end_time_ns);
  out.number(r.chunk_start_offset);
  out.number(r.chunk_length);
  out.pairs(r.message_index_offsets);
  out.number(r.message_index_length);
  out.string(r.compression);
  out.number(r.compressed_size);
  out.number(r.uncompressed_size);
}

void write_fields_before_data(ByteWriter& out, const Attachment& r) {
  out.number(r.log_time_ns);
  out.number(r.create_time_ns);
  out.string(r.name);
  out.string(r.media_type);
  out.number(std::uint64_t{r.data.size()});
}

void write(ByteWriter& out, const Attachment& r) {
  write_fields_before_data(out, r);
  out.bytes(r.data);
  out.number(r.crc);
}

void write(ByteWriter& out, const AttachmentIndex& r) {
  out.number(r.offset);
  out.number(r.length);
  out.number(r.log_time_ns);
  out.number(r.create_time_ns);
  out.number(r.data_size);
  out.string(r.name);
  out.string(r.media_type);
}

void write(ByteWriter& out, const Statistics& r) {
  out.number(r.message_count);
  out.number(r.schema_count);
  out.number(r.channel_count);
  out.number(r.attachment_count);
  out.number(r.metadata_count);
  out.number(r.chunk_count);
  out.number(r.message_start_time_ns);
  out.number(r.message_end_time_ns);
  out.pairs(r.channel_message_counts);
}

void write(ByteWriter& out, const Metadata& r) {
  out.string(r.name);
  out.string_map(r.metadata);
}

void write(ByteWriter& out, const MetadataIndex& r) {
  out.number(r.offset);
  out.number(r.length);
  out.string(r.name);
}

void write(ByteWriter& out, const SummaryOffset& r) {
  out.number(static_cast<std::uint8_t>(r.group_opcode));
  out.number(r.group_start);
  out.number(r.group_length);
}

void write(ByteWriter& out, const DataEnd& r) { out.number(r.data_section_crc); }
void write(ByteWriter& out, const UnknownRecord& r) { out.bytes(r.content); }

/// Order of the variant's alternatives.
constexpr Opcode kOpcodes[] = {Opcode::kHeader,
                               Opcode::kFooter,
                               Opcode::kSchema,
                               Opcode::kChannel,
                               Opcode::kMessage,
                               Opcode::kChunk,
                               Opcode::kMessageIndex,
                               Opcode::kChunkIndex,
                               Opcode::kAttachment,
                               Opcode::kAttachmentIndex,
                               Opcode::kStatistics,
                               Opcode::kMetadata,
                               Opcode::kMetadataIndex,
                               Opcode::kSummaryOffset,
                               Opcode::kDataEnd};

Opcode opcode_of(const Record& record) {
  if (const auto* unknown = std::get_if<UnknownRecord>(&record)) return Opcode{unknown->opcode};
  return kOpcodes[record.index()];
}

void set_length(ByteBuffer& out, std::size_t start, std::uint64_t extra) {
  const std::uint64_t length = out.size() - start - kRecordHeadSize + extra;
  std::memcpy(out.data() + start + 1, &length, sizeof(length));
}

}  // namespace

std::optional<Record> decode_record(std::uint8_t opcode, Bytes content) {
  switch (Opcode{opcode}) {
    case Opcode::kHeader:
      return decode_as<Header>(content);
    case Opcode::kFooter:
      return decode_as<Footer>(content);
    case Opcode::kSchema:
      return decode_as<Schema>(content);
    case Opcode::kChannel:
      return decode_as<Channel>(content);
    case Opcode::kMessage:
      return decode_as<Message>(content);
    case Opcode::kChunk:
      return decode_as<Chunk>(content);
    case Opcode::kMessageIndex:
      return decode_as<MessageIndex>(content);
    case Opcode::kChunkIndex:
      return decode_as<ChunkIndex>(content);
    case Opcode::kAttachment:
      return decode_as<Attachment>(content);
    case Opcode::kAttachmentIndex:
      return decode_as<AttachmentIndex>(content);
    case Opcode::kStatistics:
      return decode_as<Statistics>(content);
    case Opcode::kMetadata:
      return decode_as<Metadata>(content);
    case Opcode::kMetadataIndex:
      return decode_as<MetadataIndex>(content);
    case Opcode::kSummaryOffset:
      return decode_as<SummaryOffset>(content);
    case Opcode::kDataEnd:
      return decode_as<DataEnd>(content);
  }
  return Record(UnknownRecord{opcode, content});
}

std::optional<Message> decode_message(Bytes content) {
  Message message;
  ByteReader in(content);
  read(in, message);
  if (!in.ok()) return std::nullopt;
  return message;
}

std::optional<Chunk> decode_cut_chunk(Bytes content) {
  Chunk chunk;
  ByteReader in(content);
  read_fields_before_data(in, chunk);
  const auto size = in.number<std::uint64_t>();
  chunk.records = in.take(std::min<std::uint64_t>(size, in.remaining()));
  if (!in.ok()) return std::nullopt;
  return chunk;
}

void encode_head(Opcode opcode, std::uint64_t length, ByteBuffer& out) {
  ByteWriter writer(out);
  writer.number(static_cast<std::uint8_t>(opcode));
  writer.number(length);
}

void encode_record(const Record& record, ByteBuffer& out) {
  const std::size_t start = out.size();
  encode_head(opcode_of(record), 0, out);
  ByteWriter writer(out);
  std::visit([&writer](const auto& r) { write(writer, r); }, record);
  set_length(out, start, 0);
}

void encode_chunk_head(const Chunk& chunk, std::uint64_t size, ByteBuffer& out) {
  const std::size_t start = out.size();
  encode_head(Opcode::kChunk, 0, out);
  ByteWriter writer(out);
  write_fields_before_data(writer, chunk);
  writer.number(size);
  set_length(out, start, size);
}

void encode_message_head(const Message& message, ByteBuffer& out) {
  encode_head(Opcode::kMessage, kMessageHeadSize + message.data.size(), out);
  ByteWriter writer(out);
  write_fields_before_data(writer, message);
}

void encode_attachment_head(const Attachment& attachment, ByteBuffer& out) {
  const std::size_t start = out.size();
  encode_head(Opcode::kAttachment, 0, out);
  ByteWriter writer(out);
  write_fields_before_data(writer, attachment);
  set_length(out, start, attachment.data.size() + sizeof(std::uint32_t));
}

}  // namespace camvox::storage
