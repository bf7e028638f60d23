#include "camvox/storage/doctor.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "camvox/storage/stream_reader.hpp"

namespace camvox::storage {
namespace {

constexpr std::size_t kMaxFindings = 1000;

std::string quoted(const std::string& text) { return "'" + text + "'"; }

class Doctor {
 public:
  Doctor(const Source& in, const ReadLimits& limits)
      : in_(in),
        reader_(in, {.limits = limits, .verify_crc = true, .expand_chunks = false}),
        loader_(limits, true) {}

  DoctorResult run() {
    bool first = true;
    while (const Record* record = reader_.next()) {
      offset_ = reader_.offset();
      if (first && !std::holds_alternative<Header>(*record)) error("first record is no Header");
      if (!first && std::holds_alternative<Header>(*record)) error("Header that is not first");
      if (has_data_end_) check_summary_order();
      std::visit([this](const auto& r) { check(r); }, *record);
      first = false;
    }
    offset_ = reader_.offset();
    for (const auto& problem : reader_.problems()) {
      add(Severity::kError, problem.offset, problem.status.message());
    }
    check_end();
    finish_statistics();
    check_indexes();
    return std::move(result_);
  }

 private:
  struct SeenChunk {
    std::uint64_t length = 0;
    Chunk head;  ///< Without its records.
    std::uint64_t compressed_size = 0;
    std::uint64_t index_length = 0;
    std::map<std::uint16_t, std::uint64_t> index_offsets;
  };

  void add(Severity severity, std::uint64_t offset, std::string message) {
    if (result_.findings.size() < kMaxFindings) {
      result_.findings.push_back({severity, offset, std::move(message)});
    }
  }
  void error(std::string message) { add(Severity::kError, offset_, std::move(message)); }
  void warn(std::string message) { add(Severity::kWarning, offset_, std::move(message)); }

  void check(const Header& r) {
    if (!r.profile.empty() && r.profile != "ros1" && r.profile != "ros2") {
      warn("profile " + quoted(r.profile) + " is not one of ros1, ros2 or none");
    }
  }

  void check(const Schema& r) {
    if (r.id == 0) error("schema " + quoted(r.name) + " has id 0, which means 'no schema'");
    const auto [it, is_new] = schemas_.try_emplace(r.id, r);
    if (!is_new && !(it->second == r)) {
      error("schema id " + std::to_string(r.id) + " is defined twice, in different ways");
    }
    if (r.encoding.empty() && !r.data.empty())
      error("schema " + quoted(r.name) + " has data but no encoding");
    if (is_new && has_data_end_) warn("schema " + quoted(r.name) + " is only in the summary");
  }

  void check(const Channel& r) {
    if (r.schema_id != 0 && !schemas_.contains(r.schema_id)) {
      error("channel " + quoted(r.topic) + " refers to schema id " + std::to_string(r.schema_id) +
            ", which is not defined before it");
    }
    const auto [it, is_new] = channels_.try_emplace(r.id, r);
    if (!is_new && !(it->second == r)) {
      error("channel id " + std::to_string(r.id) + " is defined twice, in different ways");
    }
    if (is_new && has_data_end_) warn("channel " + quoted(r.topic) + " is only in the summary");
  }

  void check(const Message& r) {
    if (in_data_section("Message")) loose_messages_ = true;
    count(r);
  }

  void count(const Message& r) {
    if (!channels_.contains(r.channel_id)) {
      error("message on channel id " + std::to_string(r.channel_id) +
            ", which is not defined before it");
    }
    auto& s = result_.statistics;
    if (s.message_count > 0 && r.log_time_ns < last_time_ns_ && !warned_of_order_) {
      warn("messages are not in order of their log time (from here on, perhaps more)");
      warned_of_order_ = true;
    }
    last_time_ns_ = r.log_time_ns;
    s.message_start_time_ns =
        s.message_count == 0 ? r.log_time_ns : std::min(s.message_start_time_ns, r.log_time_ns);
    s.message_end_time_ns = std::max(s.message_end_time_ns, r.log_time_ns);
    ++s.message_count;
    ++counts_[r.channel_id];
  }

  void check(const Chunk& r) {
    if (!in_data_section("Chunk")) return;
    last_chunk_offset_ = offset_;
    SeenChunk& seen = chunks_[offset_];
    seen.head = r;
    seen.head.records = {};
    seen.compressed_size = r.records.size();
    last_messages_.clear();
    const auto records = loader_.load(r, buffer_);
    if (!records.ok()) {
      error(records.status().message());
      return;
    }
    check_chunk_records(r, *records);
  }

  void check_chunk_records(const Chunk& chunk, Bytes bytes) {
    ChunkRecords records(bytes);
    RawRecord raw;
    std::uint64_t outside = 0;
    while (records.next(raw)) {
      const auto record = decode_record(raw.opcode, raw.content);
      if (!record) {
        error("chunk holds a record that is too short for its fields");
      } else if (const auto* message = std::get_if<Message>(&*record)) {
        last_messages_[raw.offset] = {message->channel_id, message->log_time_ns};
        count(*message);
        if (message->log_time_ns < chunk.message_start_time_ns ||
            message->log_time_ns > chunk.message_end_time_ns) {
          ++outside;
        }
      } else if (const auto* schema = std::get_if<Schema>(&*record)) {
        check(*schema);
      } else if (const auto* channel = std::get_if<Channel>(&*record)) {
        check(*channel);
      } else if (!std::holds_alternative<UnknownRecord>(*record)) {
        error("chunk holds a " + std::string(to_string(Opcode{raw.opcode})));
      }
    }
    if (!records.complete()) error("chunk ends inside a record");
    if (outside > 0) {
      error(std::to_string(outside) + " messages are outside the times of their chunk");
    }
  }

  void check(const MessageIndex& r) {
    if (!in_data_section("MessageIndex")) return;
    const auto it = chunks_.find(last_chunk_offset_);
    if (it == chunks_.end()) {
      error("message index without a chunk before it");
      return;
    }
    it->second.index_offsets[r.channel_id] = offset_;
    for (const auto& [time_ns, offset] : r.records) {
      const auto message = last_messages_.find(offset);
      if (message == last_messages_.end() || message->second != std::pair(r.channel_id, time_ns)) {
        error("message index of channel id " + std::to_string(r.channel_id) +
              " does not lead to its messages");
        return;
      }
    }
  }

  void check(const Attachment&) {
    if (!in_data_section("Attachment")) return;
    ++result_.statistics.attachment_count;
    attachments_.insert(offset_);
  }
  void check(const Metadata&) {
    if (!in_data_section("Metadata")) return;
    ++result_.statistics.metadata_count;
    metadata_.insert(offset_);
  }
  void check(const DataEnd&) {
    if (has_data_end_) error("second DataEnd");
    has_data_end_ = true;
  }
  void check(const Footer& r) {
    has_footer_ = true;
    if (!has_data_end_) error("Footer without a DataEnd before it");
    if (r.summary_start > offset_ || r.summary_offset_start > offset_) {
      error("Footer points behind itself");
    }
  }
  void check(const Statistics& r) {
    if (has_statistics_) error("second Statistics");
    has_statistics_ = true;
    statistics_offset_ = offset_;
    claimed_ = r;
  }
  void check(const ChunkIndex& r) { chunk_indexes_.emplace_back(offset_, r); }
  void check(const AttachmentIndex& r) {
    if (!attachments_.contains(r.offset)) error("attachment index does not lead to an attachment");
  }
  void check(const MetadataIndex& r) {
    if (!metadata_.contains(r.offset)) error("metadata index does not lead to metadata");
  }
  void check(const SummaryOffset& r) {
    if (r.group_start > offset_ || r.group_length > offset_ - r.group_start) {
      error("summary offset leads behind itself");
    }
  }
  void check(const UnknownRecord& r) {
    warn("record of unknown opcode " + std::to_string(r.opcode));
  }

  bool in_data_section(const char* what) {
    if (has_data_end_) error(std::string(what) + " behind the end of the data section");
    return !has_data_end_;
  }

  void check_summary_order() {
    if (has_footer_) error("record behind the Footer");
  }

  void check_end() {
    if (!reader_.status().ok()) error(reader_.status().message());
    if (!has_data_end_) error("the file has no DataEnd: it was not closed, or cut off");
    if (!has_footer_) error("the file has no Footer: it was not closed, or cut off");
    if (reader_.status().ok() && offset_ + kMagic.size() < in_.size()) {
      warn(std::to_string(in_.size() - offset_ - kMagic.size()) + " bytes behind the end");
    }
  }

  void finish_statistics() {
    auto& s = result_.statistics;
    s.schema_count = static_cast<std::uint16_t>(schemas_.size());
    s.channel_count = static_cast<std::uint32_t>(channels_.size());
    s.chunk_count = static_cast<std::uint32_t>(chunks_.size());
    for (const auto& [id, count] : counts_) s.channel_message_counts.emplace_back(id, count);
    if (!has_statistics_) return;
    offset_ = statistics_offset_;
    const auto& c = claimed_;
    const auto compare = [this](const char* what, std::uint64_t claimed, std::uint64_t actual) {
      if (claimed == actual) return;
      error("statistics say " + std::string(what) + " = " + std::to_string(claimed) + ", it is " +
            std::to_string(actual));
    };
    compare("message_count", c.message_count, s.message_count);
    compare("attachment_count", c.attachment_count, s.attachment_count);
    compare("metadata_count", c.metadata_count, s.metadata_count);
    compare("chunk_count", c.chunk_count, s.chunk_count);
    compare("message_start_time", c.message_start_time_ns, s.message_start_time_ns);
    compare("message_end_time", c.message_end_time_ns, s.message_end_time_ns);
    const std::map<std::uint16_t, std::uint64_t> claimed(c.channel_message_counts.begin(),
                                                         c.channel_message_counts.end());
    for (const auto& [id, count] : counts_) {
      const auto it = claimed.find(id);
      compare("messages of a channel", it == claimed.end() ? 0 : it->second, count);
    }
  }

  void check_indexes() {
    std::set<std::uint64_t> indexed;
    for (const auto& [offset, index] : chunk_indexes_) {
      offset_ = offset;
      indexed.insert(index.chunk_start_offset);
      const auto it = chunks_.find(index.chunk_start_offset);
      if (it == chunks_.end()) {
        error("chunk index leads to offset " + std::to_string(index.chunk_start_offset) +
              ", where no chunk is");
      } else {
        compare(index, it->second);
      }
    }
    for (const auto& [offset, chunk] : chunks_) {
      offset_ = offset;
      if (!chunk_indexes_.empty() && !indexed.contains(offset)) error("chunk has no chunk index");
    }
    if (!chunk_indexes_.empty() && loose_messages_) {
      error("the file has chunk indexes, but also messages outside chunks");
    }
  }

  void compare(const ChunkIndex& index, const SeenChunk& chunk) {
    const bool same = index.message_start_time_ns == chunk.head.message_start_time_ns &&
                      index.message_end_time_ns == chunk.head.message_end_time_ns &&
                      index.compression == chunk.head.compression &&
                      index.compressed_size == chunk.compressed_size &&
                      index.uncompressed_size == chunk.head.uncompressed_size;
    if (!same) error("chunk index differs from its chunk");
    for (const auto& [id, offset] : index.message_index_offsets) {
      const auto it = chunk.index_offsets.find(id);
      if (it == chunk.index_offsets.end() || it->second != offset) {
        error("chunk index does not lead to the message index of channel id " + std::to_string(id));
      }
    }
  }

  const Source& in_;
  McapStreamReader reader_;
  ChunkLoader loader_;
  ByteBuffer buffer_;
  DoctorResult result_;
  std::uint64_t offset_ = 0;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint64_t, SeenChunk> chunks_;
  std::uint64_t last_chunk_offset_ = 0;
  /// Of the last chunk: offset of each message -> its channel and time.
  std::map<std::uint64_t, std::pair<std::uint16_t, std::uint64_t>> last_messages_;
  std::set<std::uint64_t> attachments_;
  std::set<std::uint64_t> metadata_;
  std::vector<std::pair<std::uint64_t, ChunkIndex>> chunk_indexes_;
  Statistics claimed_;
  std::uint64_t statistics_offset_ = 0;
  std::uint64_t last_time_ns_ = 0;
  bool warned_of_order_ = false;
  bool loose_messages_ = false;
  bool has_data_end_ = false;
  bool has_footer_ = false;
  bool has_statistics_ = false;
};

}  // namespace

bool DoctorResult::has_errors() const {
  return std::any_of(findings.begin(), findings.end(), [](const Finding& finding) {
    return finding.severity == Severity::kError;
  });
}

DoctorResult doctor(const Source& in, const ReadLimits& limits) { return Doctor(in, limits).run(); }

}  // namespace camvox::storage
