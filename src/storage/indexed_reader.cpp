#include "camvox/storage/indexed_reader.hpp"

#include <algorithm>

#include "camvox/storage/crc.hpp"

namespace camvox::storage {

Result<std::unique_ptr<McapIndexedReader>> McapIndexedReader::open(std::unique_ptr<Source> source,
                                                                   IndexedReaderOptions options) {
  auto summary = load_summary(*source, options.limits);
  if (!summary.ok()) return summary.status();
  return std::unique_ptr<McapIndexedReader>(
      new McapIndexedReader(std::move(source), options, std::move(*summary)));
}

Result<std::unique_ptr<McapIndexedReader>> McapIndexedReader::open(
    const std::filesystem::path& path, IndexedReaderOptions options) {
  auto source = FileSource::open(path);
  if (!source.ok()) return source.status();
  auto reader = open(std::move(*source), options);
  if (reader.ok()) return reader;
  return Status(reader.status().code(), path.string() + ": " + reader.status().message());
}

McapIndexedReader::McapIndexedReader(std::unique_ptr<Source> source,
                                     IndexedReaderOptions options,
                                     Summary summary)
    : source_(std::move(source)), options_(options), summary_(std::move(summary)) {}

MessageCursor McapIndexedReader::messages(MessageFilter filter) const {
  return MessageCursor(*this, std::move(filter));
}

Result<Record> McapIndexedReader::record_at(std::uint64_t offset,
                                            std::uint64_t length,
                                            ByteBuffer& scratch) const {
  const std::string place = "offset " + std::to_string(offset) + ": ";
  if (length < kRecordHeadSize || length - kRecordHeadSize > options_.limits.max_record_size) {
    return Status(StatusCode::kLimit, place + "a record of " + std::to_string(length) + " bytes");
  }
  const auto bytes = source_->view(offset, length, scratch);
  if (!bytes.ok()) return bytes.status();
  ChunkRecords records(*bytes);
  RawRecord raw;
  if (!records.next(raw) || !records.complete()) {
    return Status(StatusCode::kCorrupt, place + "the index does not lead to a record");
  }
  auto record = decode_record(raw.opcode, raw.content);
  if (!record) return Status(StatusCode::kCorrupt, place + "a record is too short for its fields");
  return std::move(*record);
}

Result<Metadata> McapIndexedReader::metadata(const MetadataIndex& index) const {
  ByteBuffer scratch;
  auto record = record_at(index.offset, index.length, scratch);
  if (!record.ok()) return record.status();
  if (auto* metadata = std::get_if<Metadata>(&*record)) return std::move(*metadata);
  return Status(StatusCode::kCorrupt, "the metadata index does not lead to metadata");
}

Result<Metadata> McapIndexedReader::metadata(const std::string& name) const {
  const auto& indexes = summary_.metadata_indexes;
  for (auto it = indexes.rbegin(); it != indexes.rend(); ++it) {
    if (it->name == name) return metadata(*it);
  }
  return Status(StatusCode::kInvalid, "the file has no metadata '" + name + "'");
}

Result<Attachment> McapIndexedReader::attachment(const AttachmentIndex& index,
                                                 ByteBuffer& scratch) const {
  auto record = record_at(index.offset, index.length, scratch);
  if (!record.ok()) return record.status();
  auto* attachment = std::get_if<Attachment>(&*record);
  if (attachment == nullptr) {
    return Status(StatusCode::kCorrupt, "the attachment index does not lead to an attachment");
  }
  ByteBuffer head;
  encode_attachment_head(*attachment, head);
  const std::uint32_t crc = crc32(attachment->data, crc32(head.view().subspan(kRecordHeadSize)));
  if (attachment->crc != 0 && attachment->crc != crc) {
    return Status(StatusCode::kCrcMismatch, "attachment '" + attachment->name + "' is damaged");
  }
  return std::move(*attachment);
}

MessageCursor::MessageCursor(const McapIndexedReader& reader, MessageFilter filter)
    : reader_(&reader),
      filter_(std::move(filter)),
      loader_(reader.options().limits, reader.options().verify_crc),
      window_(reader.source()) {
  select_channels();
  select_chunks();
  add_loose_messages();
}

void MessageCursor::select_channels() {
  const auto& channels = reader_->summary().channels;
  const auto& topics = filter_.topics;
  if (!channels.empty()) channels_.resize(channels.rbegin()->first + std::size_t{1}, nullptr);
  for (const auto& [id, channel] : channels) {
    const bool is_wanted =
        topics.empty() || std::find(topics.begin(), topics.end(), channel.topic) != topics.end();
    if (is_wanted) channels_[id] = &channel;
  }
}

bool MessageCursor::wanted(std::uint16_t channel_id) const {
  return channel_id < channels_.size() && channels_[channel_id] != nullptr;
}

bool MessageCursor::wanted(const Message& message) const {
  return message.log_time_ns >= filter_.start_time_ns &&
         message.log_time_ns <= filter_.end_time_ns && wanted(message.channel_id);
}

bool MessageCursor::wanted(const ChunkIndex& index) const {
  if (index.message_end_time_ns < filter_.start_time_ns ||
      index.message_start_time_ns > filter_.end_time_ns) {
    return false;
  }
  const auto& offsets = index.message_index_offsets;
  if (offsets.empty() || filter_.topics.empty()) return true;
  return std::any_of(offsets.begin(), offsets.end(), [this](const auto& channel_offset) {
    return wanted(channel_offset.first);
  });
}

void MessageCursor::select_chunks() {
  for (const auto& index : reader_->summary().chunk_indexes) {
    if (wanted(index)) chunks_.push_back(&index);
  }
  // Chunk indexes are in file order, so equal times keep it.
  std::stable_sort(chunks_.begin(), chunks_.end(), [](const auto* a, const auto* b) {
    return a->message_start_time_ns < b->message_start_time_ns;
  });
}

void MessageCursor::add_loose_messages() {
  auto run = std::make_unique<Run>();
  for (const auto& message : reader_->summary().loose_messages) {
    if (message.log_time_ns < filter_.start_time_ns) continue;
    if (message.log_time_ns > filter_.end_time_ns) continue;
    run->entries.push_back({message.log_time_ns, message.offset});
  }
  std::stable_sort(run->entries.begin(), run->entries.end(), [](const Entry& a, const Entry& b) {
    return a.log_time_ns < b.log_time_ns;
  });
  push(std::move(run));
}

/// Order of the heap: time, then place in the file; loose messages come first.
bool MessageCursor::later(const std::unique_ptr<Run>& a, const std::unique_ptr<Run>& b) {
  const auto key = [](const Run& run) {
    return std::pair(run.entries[run.position].log_time_ns,
                     run.index == nullptr ? 0 : run.index->chunk_start_offset);
  };
  return key(*a) > key(*b);
}

void MessageCursor::push(std::unique_ptr<Run> run) {
  if (run->position < run->entries.size()) {
    runs_.push_back(std::move(run));
    std::push_heap(runs_.begin(), runs_.end(), later);
    return;
  }
  pending_ -= run->index == nullptr ? 0 : run->entries.size();
  run->entries.clear();
  run->records = {};
  spare_.push_back(std::move(run));
}

std::unique_ptr<MessageCursor::Run> MessageCursor::pop() {
  std::pop_heap(runs_.begin(), runs_.end(), later);
  auto run = std::move(runs_.back());
  runs_.pop_back();
  return run;
}

/// Drops the chunks that wait, when all together are more than the cache may hold.
void MessageCursor::make_room(const Run& keep) {
  std::uint64_t memory = keep.memory();
  for (const auto& run : runs_) memory += run->memory();
  if (memory <= reader_->options().cache_size) return;
  spare_.clear();
  for (const auto& run : runs_) {
    run->raw.release();
    run->decompressed.release();
    run->records = {};
  }
}

Status MessageCursor::load(Run& run) {
  const auto& index = *run.index;
  const auto corrupt = [](const char* what) { return Status(StatusCode::kCorrupt, what); };
  if (index.chunk_length - kRecordHeadSize > reader_->options().limits.max_record_size) {
    return {StatusCode::kLimit, "a chunk of " + std::to_string(index.chunk_length) + " bytes"};
  }
  const auto bytes = reader_->source().view(index.chunk_start_offset, index.chunk_length, run.raw);
  if (!bytes.ok()) return bytes.status();
  ChunkRecords delimiter(*bytes);
  RawRecord raw;
  if (!delimiter.next(raw) || !delimiter.complete() || !raw.is(Opcode::kChunk)) {
    return corrupt("the chunk index does not lead to a chunk");
  }
  const auto record = decode_record(raw.opcode, raw.content);
  if (!record) return corrupt("a chunk is too short for its fields");
  const auto records = loader_.load(std::get<Chunk>(*record), run.decompressed);
  if (!records.ok()) return records.status();
  run.records = *records;
  make_room(run);
  return {};
}

Status MessageCursor::list_entries(Run& run) const {
  ChunkRecords records(run.records);
  RawRecord raw;
  bool in_order = true;
  while (records.next(raw)) {
    if (!raw.is(Opcode::kMessage)) continue;
    const auto message = decode_message(raw.content);
    if (!message) return {StatusCode::kCorrupt, "a message is too short for its fields"};
    if (!wanted(*message)) continue;
    auto& entries = run.entries;
    in_order = in_order && (entries.empty() || entries.back().log_time_ns <= message->log_time_ns);
    entries.push_back({message->log_time_ns, raw.offset});
    if (pending_ + entries.size() > reader_->options().limits.max_pending_messages) {
      return {StatusCode::kLimit, "too many messages in chunks that overlap in time"};
    }
  }
  if (!records.complete()) return {StatusCode::kCorrupt, "a chunk holds a bad record"};
  if (!in_order) {
    std::stable_sort(run.entries.begin(), run.entries.end(), [](const Entry& a, const Entry& b) {
      return a.log_time_ns < b.log_time_ns;
    });
  }
  return {};
}

Status MessageCursor::open_chunk(const ChunkIndex& index) {
  auto run = spare_.empty() ? std::make_unique<Run>() : std::move(spare_.back());
  if (!spare_.empty()) spare_.pop_back();
  run->index = &index;
  run->position = 0;
  auto status = load(*run);
  if (status.ok()) status = list_entries(*run);
  if (!status.ok()) run->entries.clear();
  pending_ += run->entries.size();
  push(std::move(run));
  if (status.ok()) return status;
  return {status.code(),
          "offset " + std::to_string(index.chunk_start_offset) + ": " + status.message()};
}

/// Opens the chunks that may hold the next message. False when one cannot be read and that matters.
bool MessageCursor::open_due_chunks() {
  while (next_chunk_ < chunks_.size()) {
    const ChunkIndex& index = *chunks_[next_chunk_];
    if (!runs_.empty()) {
      const Run& first = *runs_.front();
      if (index.message_start_time_ns > first.entries[first.position].log_time_ns) break;
    }
    ++next_chunk_;
    auto status = open_chunk(index);
    if (status.ok()) continue;
    if (!reader_->options().skip_bad_chunks) {
      status_ = std::move(status);
      return false;
    }
    problems_.push_back({index.chunk_start_offset, std::move(status)});
  }
  return true;
}

/// Content of the message record at the offset of a run.
Result<Bytes> MessageCursor::message_content(Run& run, std::uint64_t offset) {
  if (run.index != nullptr) {
    if (run.records.empty()) {
      if (auto status = load(run); !status.ok()) return status;
    }
    // Looked at again: the file may have changed since the entries were listed.
    ChunkRecords records(run.records.subspan(std::min<std::size_t>(offset, run.records.size())));
    RawRecord raw;
    if (records.next(raw) && raw.is(Opcode::kMessage)) return raw.content;
    return Status(StatusCode::kCorrupt, "the file changed while it was read");
  }
  auto head = window_.view(offset, kRecordHeadSize);
  if (!head.ok()) return head.status();
  std::uint64_t length = 0;
  std::memcpy(&length, head->data() + 1, sizeof(length));
  if (length > reader_->options().limits.max_record_size) {
    return Status(StatusCode::kLimit, "a message of " + std::to_string(length) + " bytes");
  }
  const auto record = window_.view(offset, kRecordHeadSize + length);
  if (!record.ok()) return record.status();
  return record->subspan(kRecordHeadSize);
}

const Message* MessageCursor::next() {
  while (status_.ok() && open_due_chunks() && !runs_.empty()) {
    auto run = pop();
    const auto content = message_content(*run, run->entries[run->position].offset);
    ++run->position;
    push(std::move(run));
    std::optional<Message> message;
    if (content.ok()) message = decode_message(*content);
    if (!message) {
      status_ =
          content.ok() ? Status(StatusCode::kCorrupt, "a message is too short") : content.status();
      return nullptr;
    }
    // The channel of a loose message is only known now; and the file may have changed.
    if (!wanted(*message)) continue;
    message_ = *message;
    channel_ = channels_[message_.channel_id];
    return &message_;
  }
  return nullptr;
}

}  // namespace camvox::storage
