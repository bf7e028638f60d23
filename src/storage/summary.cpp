#include "camvox/storage/summary.hpp"

#include <algorithm>
#include <array>
#include <string>

#include "camvox/storage/crc.hpp"
#include "camvox/storage/stream_reader.hpp"

namespace camvox::storage {
namespace {

Status unusable(std::uint64_t offset, const std::string& what) {
  return {StatusCode::kCorrupt, "offset " + std::to_string(offset) + ": " + what};
}

/// Footer of a file with a summary.
Result<Footer> read_footer(const Source& source) {
  if (auto status = check_magic(source); !status.ok()) return status;
  const std::uint64_t end_size = kFooterRecordSize + kMagic.size();
  if (source.size() < kMagic.size() + end_size) {
    return Status(StatusCode::kTruncated, "the file is too short for a footer");
  }
  ByteBuffer scratch;
  const auto end = source.view(source.size() - end_size, end_size, scratch);
  if (!end.ok()) return end.status();
  const bool has_magic = as_text(end->last(kMagic.size())) == kMagic;
  const auto record = decode_record(std::to_integer<std::uint8_t>(end->front()),
                                    end->first(kFooterRecordSize).subspan(kRecordHeadSize));
  if (!has_magic || !record || !std::holds_alternative<Footer>(*record)) {
    return Status(StatusCode::kTruncated,
                  "the file does not end with a footer: it was not closed, or cut off");
  }
  const Footer footer = std::get<Footer>(*record);
  const std::uint64_t footer_start = source.size() - end_size;
  if (footer.summary_start == 0) return unusable(footer_start, "the file has no summary");
  if (footer.summary_start > footer_start || footer.summary_start < kMagic.size()) {
    return unusable(footer_start, "the footer points outside the file");
  }
  return footer;
}

struct AddToSummary {
  Summary& summary;
  bool& has_statistics;

  void operator()(const Schema& r) const { summary.schemas.emplace(r.id, r); }
  void operator()(const Channel& r) const { summary.channels.emplace(r.id, r); }
  void operator()(const ChunkIndex& r) const { summary.chunk_indexes.push_back(r); }
  void operator()(const AttachmentIndex& r) const { summary.attachment_indexes.push_back(r); }
  void operator()(const MetadataIndex& r) const { summary.metadata_indexes.push_back(r); }
  void operator()(const Statistics& r) const {
    summary.statistics = r;
    has_statistics = true;
  }
  template <typename T>
  void operator()(const T&) const {}
};

/// Whether the chunk indexes are apart from each other and inside the data section. Otherwise a
/// small forged file could send the reader through the same chunk for hours.
Status check_chunk_indexes(std::vector<ChunkIndex>& indexes, std::uint64_t data_end) {
  std::sort(indexes.begin(), indexes.end(), [](const ChunkIndex& a, const ChunkIndex& b) {
    return a.chunk_start_offset < b.chunk_start_offset;
  });
  std::uint64_t free_from = kMagic.size();
  for (const auto& index : indexes) {
    const std::uint64_t start = index.chunk_start_offset;
    if (start < free_from || start > data_end || index.chunk_length > data_end - start ||
        index.chunk_length < kRecordHeadSize) {
      return unusable(start, "a chunk index overlaps another or leaves the data section");
    }
    free_from = start + index.chunk_length;
  }
  return {};
}

/// Whether the summary leads to every message of the file.
Status check_complete(const Summary& summary, bool has_statistics) {
  if (!has_statistics) return unusable(0, "the summary has no statistics");
  const auto& s = summary.statistics;
  // More channels than counted is fine: libmcap lists those without a message, but counts none.
  if (s.chunk_count != summary.chunk_indexes.size() || s.channel_count > summary.channels.size() ||
      s.schema_count > summary.schemas.size() ||
      s.attachment_count > summary.attachment_indexes.size() ||
      s.metadata_count > summary.metadata_indexes.size()) {
    return unusable(0, "the summary does not list all that its statistics count");
  }
  if (s.message_count > 0 && summary.chunk_indexes.empty()) {
    return unusable(0, "the messages are not in chunks");
  }
  for (const auto& [id, channel] : summary.channels) {
    if (channel.schema_id != 0 && !summary.schemas.contains(channel.schema_id)) {
      return unusable(0, "channel " + channel.topic + " has a schema that is not in the summary");
    }
  }
  return {};
}

Status read_header(const Source& source, const ReadLimits& limits, Header& header) {
  RecordReader reader(source, limits);
  RawRecord raw;
  if (!reader.next(raw)) return reader.status();
  const auto record = decode_record(raw.opcode, raw.content);
  if (!record || !std::holds_alternative<Header>(*record)) {
    return unusable(raw.offset, "the first record is not a header");
  }
  header = std::get<Header>(*record);
  return {};
}

}  // namespace

Result<Summary> read_summary(const Source& source, const ReadLimits& limits) {
  const auto footer = read_footer(source);
  if (!footer.ok()) return footer.status();
  const std::uint64_t footer_start = source.size() - kMagic.size() - kFooterRecordSize;
  const std::uint64_t size = footer_start - footer->summary_start;
  if (size > limits.max_record_size) {
    return Status(StatusCode::kLimit,
                  "the summary of " + std::to_string(size) + " bytes is over the limit");
  }
  ByteBuffer buffer;
  const auto bytes =
      source.view(footer->summary_start, size + kFooterRecordSize - sizeof(std::uint32_t), buffer);
  if (!bytes.ok()) return bytes.status();
  if (footer->summary_crc != 0 && crc32(*bytes) != footer->summary_crc) {
    return Status(StatusCode::kCrcMismatch, "the summary is damaged: its CRC differs");
  }
  Summary summary;
  bool has_statistics = false;
  ChunkRecords records(bytes->first(static_cast<std::size_t>(size)));
  RawRecord raw;
  while (records.next(raw)) {
    const auto record = decode_record(raw.opcode, raw.content);
    if (!record) return unusable(footer->summary_start + raw.offset, "a summary record is corrupt");
    std::visit(AddToSummary{summary, has_statistics}, *record);
  }
  if (!records.complete()) return unusable(footer_start, "the summary is corrupt");
  if (auto status = check_complete(summary, has_statistics); !status.ok()) return status;
  auto status = check_chunk_indexes(summary.chunk_indexes, footer->summary_start);
  if (!status.ok()) return status;
  status = read_header(source, limits, summary.header);
  if (!status.ok()) return status;
  return summary;
}

namespace {

/// Builds a summary record by record.
class SummaryScan {
 public:
  SummaryScan(const Source& source, const ReadLimits& limits)
      : reader_(source, limits), loader_(limits, true) {
    summary_.rebuilt = true;
  }

  Summary run() {
    RawRecord raw;
    while (!done_ && reader_.next(raw)) add(raw);
    if (!reader_.status().ok()) note(reader_.offset(), reader_.status());
    for (const auto& [id, count] : counts_) {
      summary_.statistics.channel_message_counts.emplace_back(id, count);
    }
    auto& s = summary_.statistics;
    s.schema_count = static_cast<std::uint16_t>(summary_.schemas.size());
    s.channel_count = static_cast<std::uint32_t>(summary_.channels.size());
    s.chunk_count = static_cast<std::uint32_t>(summary_.chunk_indexes.size());
    s.attachment_count = static_cast<std::uint32_t>(summary_.attachment_indexes.size());
    s.metadata_count = static_cast<std::uint32_t>(summary_.metadata_indexes.size());
    return std::move(summary_);
  }

 private:
  void note(std::uint64_t offset, Status status) {
    summary_.problems.push_back({offset, std::move(status)});
  }

  void add(const RawRecord& raw) {
    if (raw.is(Opcode::kMessage)) {
      const auto message = decode_message(raw.content);
      if (message && count(*message, raw.offset)) {
        summary_.loose_messages.push_back({message->log_time_ns, raw.offset});
      }
      return;
    }
    const auto record = decode_record(raw.opcode, raw.content);
    if (!record) {
      note(raw.offset, unusable(raw.offset, "a record is too short for its fields"));
      return;
    }
    std::visit([&](const auto& r) { handle(r, raw); }, *record);
  }

  void handle(const Header& r, const RawRecord& raw) {
    if (raw.offset == kMagic.size()) summary_.header = r;
  }
  void handle(const Schema& r, const RawRecord&) { summary_.schemas.emplace(r.id, r); }
  void handle(const Channel& r, const RawRecord&) { summary_.channels.emplace(r.id, r); }
  void handle(const Metadata& r, const RawRecord& raw) {
    summary_.metadata_indexes.push_back({raw.offset, raw.end() - raw.offset, r.name});
  }
  void handle(const Attachment& r, const RawRecord& raw) {
    summary_.attachment_indexes.push_back({raw.offset,
                                           raw.end() - raw.offset,
                                           r.log_time_ns,
                                           r.create_time_ns,
                                           r.data.size(),
                                           r.name,
                                           r.media_type});
  }
  void handle(const Chunk& r, const RawRecord& raw) {
    const auto records = loader_.load(r, buffer_);
    if (!records.ok()) {
      note(raw.offset,
           {records.status().code(),
            "offset " + std::to_string(raw.offset) + ": " + records.status().message()});
      return;
    }
    add_chunk(r, raw, *records);
  }
  void handle(const DataEnd&, const RawRecord&) { done_ = true; }
  void handle(const Footer&, const RawRecord&) { done_ = true; }
  template <typename T>
  void handle(const T&, const RawRecord&) {}

  /// Times come from the messages, not from the chunk's head, which may be wrong.
  void add_chunk(const Chunk& chunk, const RawRecord& raw, Bytes bytes) {
    ChunkIndex index{.message_start_time_ns = 0,
                     .message_end_time_ns = 0,
                     .chunk_start_offset = raw.offset,
                     .chunk_length = raw.end() - raw.offset,
                     .message_index_offsets = {},
                     .message_index_length = 0,
                     .compression = chunk.compression,
                     .compressed_size = chunk.records.size(),
                     .uncompressed_size = chunk.uncompressed_size};
    ChunkRecords records(bytes);
    RawRecord inner;
    bool first = true;
    while (records.next(inner)) {
      if (inner.is(Opcode::kSchema) || inner.is(Opcode::kChannel)) add(inner);
      if (!inner.is(Opcode::kMessage)) continue;
      const auto message = decode_message(inner.content);
      if (!message || !count(*message, raw.offset)) continue;
      const std::uint64_t time_ns = message->log_time_ns;
      index.message_start_time_ns =
          first ? time_ns : std::min(index.message_start_time_ns, time_ns);
      index.message_end_time_ns = std::max(index.message_end_time_ns, time_ns);
      first = false;
    }
    if (!records.complete()) {
      note(raw.offset, unusable(raw.offset, "a chunk is corrupt inside; its rest is left out"));
    }
    summary_.chunk_indexes.push_back(std::move(index));
  }

  /// False for a message on an unknown channel, which nobody could decode.
  bool count(const Message& message, std::uint64_t offset) {
    if (!summary_.channels.contains(message.channel_id)) {
      if (!unknown_channels_[message.channel_id]) {
        unknown_channels_[message.channel_id] = true;
        note(offset,
             unusable(offset,
                      "messages on channel id " + std::to_string(message.channel_id) +
                          ", which is not defined, are left out"));
      }
      return false;
    }
    auto& s = summary_.statistics;
    const std::uint64_t time_ns = message.log_time_ns;
    s.message_start_time_ns =
        s.message_count == 0 ? time_ns : std::min(s.message_start_time_ns, time_ns);
    s.message_end_time_ns = std::max(s.message_end_time_ns, time_ns);
    ++s.message_count;
    ++counts_[message.channel_id];
    return true;
  }

  RecordReader reader_;
  ChunkLoader loader_;
  ByteBuffer buffer_;
  Summary summary_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint16_t, bool> unknown_channels_;
  bool done_ = false;
};

}  // namespace

Result<Summary> scan_summary(const Source& source, const ReadLimits& limits) {
  if (auto status = check_magic(source); !status.ok()) return status;
  return SummaryScan(source, limits).run();
}

Result<Summary> load_summary(const Source& source, const ReadLimits& limits) {
  auto summary = read_summary(source, limits);
  if (summary.ok()) return summary;
  auto scanned = scan_summary(source, limits);
  if (scanned.ok()) {
    auto& problems = scanned->problems;
    problems.insert(problems.begin(), {source.size(), summary.status()});
  }
  return scanned;
}

}  // namespace camvox::storage
