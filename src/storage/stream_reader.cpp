#include "camvox/storage/stream_reader.hpp"

#include <array>

#include "camvox/storage/crc.hpp"

namespace camvox::storage {
namespace {

std::string name_of(const RawRecord& raw) { return std::string(to_string(Opcode{raw.opcode})); }

std::array<std::byte, kRecordHeadSize> head_bytes(const RawRecord& raw) {
  std::array<std::byte, kRecordHeadSize> head{std::byte{raw.opcode}};
  const std::uint64_t length = raw.content.size();
  std::memcpy(head.data() + 1, &length, sizeof(length));
  return head;
}

}  // namespace

McapStreamReader::McapStreamReader(const Source& source, StreamReaderOptions options)
    : options_(options),
      reader_(source, options.limits),
      loader_(options.limits, options.verify_crc),
      status_(check_magic(source)),
      crc_(crc32(as_bytes(kMagic))) {
  at_end_ = !status_.ok();
}

const Record* McapStreamReader::stop(Status status) {
  status_ = std::move(status);
  at_end_ = true;
  in_chunk_ = false;
  return nullptr;
}

void McapStreamReader::note(StatusCode code, std::string what) {
  problems_.push_back({offset_, Status(code, std::move(what))});
}

const Record* McapStreamReader::next() {
  while (!at_end_) {
    const Record* record = in_chunk_ ? next_in_chunk() : next_top_level();
    if (record != nullptr) return record;
  }
  return nullptr;
}

/// Running CRC of data section and summary. The footer's own CRC is not part of it.
void McapStreamReader::sum(const RawRecord& raw) {
  if (!options_.verify_crc) return;
  crc_ = crc32(head_bytes(raw), crc_);
  if (const auto* chunk = std::get_if<Chunk>(&record_)) return sum_chunk(raw.content, *chunk);
  const std::size_t size =
      raw.is(Opcode::kFooter) ? std::min<std::size_t>(raw.content.size(), 16) : raw.content.size();
  crc_ = crc32(raw.content.first(size), crc_);
}

/// A chunk that is not compressed has a CRC of the same bytes: they are gone through once for both.
void McapStreamReader::sum_chunk(Bytes content, const Chunk& chunk) {
  chunk_crc_ = 0;
  if (chunk.records.empty()) {
    crc_ = crc32(content, crc_);
    return;
  }
  const auto begin = static_cast<std::size_t>(chunk.records.data() - content.data());
  const auto end = begin + chunk.records.size();
  chunk_crc_ = crc32(chunk.records);
  crc_ = crc32(content.first(begin), crc_);
  crc_ = crc32_combine(crc_, chunk_crc_, chunk.records.size());
  crc_ = crc32(content.subspan(end), crc_);
}

void McapStreamReader::check_crc(const RawRecord& raw) {
  if (const auto* footer = std::get_if<Footer>(&record_)) {
    sum(raw);
    const bool whole = footer->summary_start == 0 || footer->summary_start == summary_start_;
    if (options_.verify_crc && footer->summary_crc != 0 &&
        (!whole || footer->summary_crc != crc_)) {
      note(StatusCode::kCrcMismatch, "the summary is damaged: its CRC differs");
    }
  } else if (const auto* data_end = std::get_if<DataEnd>(&record_)) {
    if (options_.verify_crc && data_end->data_section_crc != 0 &&
        data_end->data_section_crc != crc_) {
      note(StatusCode::kCrcMismatch, "the data section is damaged: its CRC differs");
    }
    crc_ = 0;
    summary_start_ = raw.end();
  } else {
    sum(raw);
    const auto* attachment = std::get_if<Attachment>(&record_);
    if (attachment == nullptr || !options_.verify_crc || attachment->crc == 0) return;
    const auto end = static_cast<std::size_t>(attachment->data.data() + attachment->data.size() -
                                              raw.content.data());
    if (crc32(raw.content.first(end)) != attachment->crc) {
      note(StatusCode::kCrcMismatch, "attachment '" + attachment->name + "' is damaged");
    }
  }
}

const Record* McapStreamReader::next_top_level() {
  RawRecord raw;
  if (!reader_.next(raw)) {
    offset_ = reader_.offset();
    return stop(reader_.status());
  }
  offset_ = raw.offset;
  auto record = decode_record(raw.opcode, raw.content);
  if (!record) {
    return stop({StatusCode::kCorrupt,
                 "offset " + std::to_string(offset_) + ": " + name_of(raw) +
                     " is too short for its fields"});
  }
  record_ = std::move(*record);
  check_crc(raw);
  if (std::holds_alternative<Chunk>(record_) && options_.expand_chunks) {
    if (!open_chunk()) return nullptr;
    return next_in_chunk();
  }
  return &record_;
}

bool McapStreamReader::open_chunk() {
  const auto crc = options_.verify_crc ? std::optional(chunk_crc_) : std::nullopt;
  auto records = loader_.load(std::get<Chunk>(record_), chunk_buffer_, crc);
  if (records.ok()) {
    chunk_records_ = ChunkRecords(*records);
    in_chunk_ = true;
    return true;
  }
  if (options_.skip_bad_chunks) {
    problems_.push_back({offset_, records.status()});
  } else {
    stop({records.status().code(),
          "offset " + std::to_string(offset_) + ": " + records.status().message()});
  }
  return false;
}

const Record* McapStreamReader::next_in_chunk() {
  RawRecord raw;
  in_chunk_ = chunk_records_.next(raw);
  if (!in_chunk_ && chunk_records_.complete()) return nullptr;
  std::optional<Record> record;
  if (in_chunk_) record = decode_record(raw.opcode, raw.content);
  const bool allowed = raw.is(Opcode::kSchema) || raw.is(Opcode::kChannel) ||
                       raw.is(Opcode::kMessage) || raw.opcode > 0x0F;
  if (record && allowed) {
    record_ = std::move(*record);
    return &record_;
  }
  in_chunk_ = false;
  Status status(StatusCode::kCorrupt,
                "offset " + std::to_string(offset_) + ": chunk holds a bad record at " +
                    std::to_string(chunk_records_.position()));
  if (!options_.skip_bad_chunks) return stop(std::move(status));
  problems_.push_back({offset_, std::move(status)});
  return nullptr;
}

}  // namespace camvox::storage
