#include "camvox/storage/recover.hpp"

#include <algorithm>
#include <string>

#include "camvox/storage/crc.hpp"
#include "camvox/storage/summary.hpp"

namespace camvox::storage {
namespace {

class Recovery {
 public:
  Recovery(const Source& in, const RecoverOptions& options)
      : in_(in),
        options_(options),
        reader_(in, options.limits),
        loader_(options.limits, true),
        crc_(crc32(as_bytes(kMagic))) {
    if (auto summary = read_summary(in, options.limits); summary.ok()) {
      summary_ = std::move(*summary);
    }
  }

  RecoverResult run(std::unique_ptr<Sink> out) {
    open(std::move(out));
    while (result_.status.ok() && !done_) {
      RawRecord raw;
      if (reader_.next(raw)) {
        add(raw);
        report_progress();
      } else if (!skip_damage()) {
        break;
      }
    }
    if (result_.status.ok()) result_.status = writer_->close();
    result_.statistics = writer_->statistics();
    return std::move(result_);
  }

 private:
  void report_progress() {
    if (!options_.progress || options_.progress(reader_.offset()) || !result_.status.ok()) return;
    result_.status = {StatusCode::kInvalid, "interrupted"};
  }

  void open(std::unique_ptr<Sink> out) {
    McapWriterOptions writer = options_.writer;
    writer.profile.clear();
    writer.library.clear();
    look_ahead(writer);
    if (options_.compression) writer.compression = *options_.compression;
    writer_.emplace(writer);
    result_.status = writer_->open(std::move(out));
  }

  /// Header and compression of the file.
  void look_ahead(McapWriterOptions& writer) {
    RecordReader reader(in_, options_.limits);
    RawRecord raw;
    while (reader.next(raw) && !raw.is(Opcode::kMessage)) {
      const auto record = decode_record(raw.opcode, raw.content);
      if (!record) continue;
      if (const auto* header = std::get_if<Header>(&*record)) {
        writer.profile = header->profile;
        writer.library = header->library;
      } else if (const auto* chunk = std::get_if<Chunk>(&*record)) {
        writer.compression = parse_compression(chunk->compression).value_or(Compression::kNone);
        return;
      }
    }
  }

  void lose(std::uint64_t offset, StatusCode code, const std::string& what) {
    result_.lost = true;
    result_.problems.push_back({offset, {code, "offset " + std::to_string(offset) + ": " + what}});
  }

  void sum(const RawRecord& raw) {
    ByteBuffer head;
    encode_head(Opcode{raw.opcode}, raw.content.size(), head);
    crc_ = crc32(raw.content, crc32(head.view(), crc_));
  }

  void add(const RawRecord& raw) {
    const auto record = decode_record(raw.opcode, raw.content);
    if (!record) {
      lose(raw.offset, StatusCode::kCorrupt, "a record is too short for its fields, left out");
      return;
    }
    if (!raw.is(Opcode::kDataEnd)) sum(raw);
    std::visit([&](const auto& r) { copy(r, raw.offset); }, *record);
  }

  /// An invalid record is left out; any other error is the output's and ends the recovery.
  void check(const Status& status, std::uint64_t offset) {
    if (status.ok()) return;
    if (status.code() == StatusCode::kInvalid) {
      lose(offset, StatusCode::kCorrupt, status.message() + ", left out");
    } else {
      result_.status = status;
    }
  }

  void copy(const Schema& r, std::uint64_t offset) { check(writer_->add_schema(r), offset); }
  void copy(const Channel& r, std::uint64_t offset) {
    add_schema_from_summary(r.schema_id);
    check(writer_->add_channel(r), offset);
    known_channels_[r.id] = true;
  }
  void copy(const Attachment& r, std::uint64_t offset) {
    ByteBuffer head;
    encode_attachment_head(r, head);
    const std::uint32_t crc = crc32(r.data, crc32(head.view().subspan(kRecordHeadSize)));
    if (r.crc != 0 && crc != r.crc) {
      lose(offset, StatusCode::kCrcMismatch, "attachment '" + r.name + "' is damaged, left out");
      return;
    }
    check(writer_->write(r), offset);
  }
  void copy(const Metadata& r, std::uint64_t offset) { check(writer_->write(r), offset); }
  void copy(const Message& r, std::uint64_t offset) {
    add_channel_from_summary(r.channel_id);
    check(writer_->write(r), offset);
  }
  void copy(const Chunk& r, std::uint64_t offset) {
    const auto records = loader_.load(r, buffer_);
    if (!records.ok()) {
      lose(offset, records.status().code(), records.status().message() + "; chunk left out");
      return;
    }
    if (!copy_chunk(*records, offset)) {
      lose(offset, StatusCode::kCorrupt, "a chunk holds a bad record; its rest is left out");
    }
  }
  void copy(const DataEnd& r, std::uint64_t offset) {
    done_ = true;
    if (r.data_section_crc != 0 && r.data_section_crc != crc_ && !result_.lost) {
      lose(offset, StatusCode::kCrcMismatch, "some record is damaged: the CRC of the data differs");
    }
  }
  void copy(const Footer&, std::uint64_t offset) {
    done_ = true;
    lose(offset, StatusCode::kCorrupt, "the data section has no end record");
  }
  template <typename T>
  void copy(const T&, std::uint64_t) {}

  bool copy_chunk(Bytes bytes, std::uint64_t offset) {
    ChunkRecords records(bytes);
    RawRecord raw;
    while (result_.status.ok() && records.next(raw)) {
      const bool allowed =
          raw.is(Opcode::kSchema) || raw.is(Opcode::kChannel) || raw.is(Opcode::kMessage);
      if (!allowed) continue;
      const auto record = decode_record(raw.opcode, raw.content);
      if (!record) return false;
      std::visit([&](const auto& r) { copy(r, offset); }, *record);
    }
    return records.complete() || !result_.status.ok();
  }

  void add_schema_from_summary(std::uint16_t id) {
    if (const auto it = summary_.schemas.find(id); it != summary_.schemas.end()) {
      (void)writer_->add_schema(it->second).ok();
    }
  }

  /// The channel's own record may have been in a chunk that is lost.
  void add_channel_from_summary(std::uint16_t id) {
    if (known_channels_[id]) return;
    known_channels_[id] = true;
    if (const auto it = summary_.channels.find(id); it != summary_.channels.end()) {
      add_schema_from_summary(it->second.schema_id);
      (void)writer_->add_channel(it->second).ok();
    }
  }

  /// Where the reader cannot go on: false when nothing more can be had.
  bool skip_damage() {
    const std::uint64_t offset = reader_.offset();
    lose(offset, reader_.status().code(), reader_.status().message());
    const auto& indexes = summary_.chunk_indexes;
    const auto next = std::find_if(indexes.begin(), indexes.end(), [offset](const ChunkIndex& i) {
      return i.chunk_start_offset > offset;
    });
    if (next != indexes.end()) {
      reader_.seek(next->chunk_start_offset);
      return true;
    }
    if (summary_.chunk_indexes.empty()) salvage(offset);
    return false;
  }

  /// Complete messages of a last chunk that was cut off.
  void salvage(std::uint64_t offset) {
    const std::uint64_t size = in_.size() - std::min(in_.size(), offset);
    if (size <= kRecordHeadSize || size > options_.limits.max_record_size) return;
    ByteBuffer tail;
    const auto bytes = in_.view(offset, size, tail);
    if (!bytes.ok() || Opcode{std::to_integer<std::uint8_t>(bytes->front())} != Opcode::kChunk) {
      return;
    }
    const auto chunk = decode_cut_chunk(bytes->subspan(kRecordHeadSize));
    if (!chunk) return;
    const std::uint64_t before = writer_->statistics().message_count;
    (void)copy_chunk(loader_.load_prefix(*chunk, buffer_), offset);
    result_.unverified_messages = writer_->statistics().message_count - before;
  }

  const Source& in_;
  const RecoverOptions& options_;
  RecordReader reader_;
  ChunkLoader loader_;
  std::uint32_t crc_;
  Summary summary_;
  std::map<std::uint16_t, bool> known_channels_;
  ByteBuffer buffer_;
  std::optional<McapWriter> writer_;
  RecoverResult result_;
  bool done_ = false;
};

}  // namespace

RecoverResult recover(const Source& in, std::unique_ptr<Sink> out, const RecoverOptions& options) {
  if (auto status = check_magic(in); !status.ok()) return {std::move(status), true, {}, 0, {}};
  return Recovery(in, options).run(std::move(out));
}

}  // namespace camvox::storage
