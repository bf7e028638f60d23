#include "camvox/storage/bag_reader.hpp"

#include <algorithm>
#include <charconv>
#include <limits>

namespace camvox::storage {
namespace {

std::int64_t to_signed(std::uint64_t time_ns) {
  return static_cast<std::int64_t>(
      std::min<std::uint64_t>(time_ns, std::numeric_limits<std::int64_t>::max()));
}

std::string value_of(const StringMap& map, const std::string& key) {
  const auto it = map.find(key);
  return it == map.end() ? std::string() : it->second;
}

/// Number at the end of "name_12.mcap"; files without one come first.
std::int64_t file_number(const std::filesystem::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t digits = stem.find_last_not_of("0123456789") + 1;
  std::int64_t number = -1;
  std::from_chars(stem.data() + digits, stem.data() + stem.size(), number);
  return number;
}

Result<std::vector<std::filesystem::path>> mcap_files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".mcap") files.push_back(entry.path());
  }
  if (error) return Status(StatusCode::kIo, folder.string() + ": " + error.message());
  if (files.empty()) return Status(StatusCode::kIo, folder.string() + ": has no .mcap file");
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
    return std::pair(file_number(a), a) < std::pair(file_number(b), b);
  });
  return files;
}

/// A path of metadata.yaml stays in the folder of the bag: a bag from elsewhere cannot lead to
/// other files of this machine. Older bags have the folder's name in front.
Result<std::filesystem::path> inside(const std::filesystem::path& folder, const std::string& path) {
  const std::filesystem::path name = std::filesystem::path(path).filename();
  if (name.empty() || name == "." || name == "..") {
    return Status(StatusCode::kCorrupt,
                  folder.string() + ": metadata.yaml names a file '" + path + "'");
  }
  return folder / name;
}

}  // namespace

Result<std::unique_ptr<BagReader>> BagReader::open(const std::filesystem::path& path,
                                                   IndexedReaderOptions options) {
  std::unique_ptr<BagReader> reader(new BagReader());
  std::vector<std::filesystem::path> files = {path};
  bool has_metadata = false;
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    auto metadata = read_bag_metadata(path);
    has_metadata = metadata.ok() && !metadata->files.empty();
    files.clear();
    if (has_metadata) {
      for (const auto& file : metadata->files) {
        auto inner = inside(path, file.path);
        if (!inner.ok()) return inner.status();
        files.push_back(std::move(*inner));
      }
      reader->metadata_ = std::move(*metadata);
    } else {
      auto found = mcap_files_in(path);
      if (!found.ok()) return found.status();
      files = std::move(*found);
      if (!metadata.ok()) reader->problems_.push_back({0, metadata.status()});
    }
  }
  for (const auto& file : files) {
    if (auto status = reader->add_file(file, options); !status.ok()) return status;
  }
  reader->finish_metadata(has_metadata);
  return reader;
}

Status BagReader::add_file(const std::filesystem::path& path, const IndexedReaderOptions& options) {
  auto reader = McapIndexedReader::open(path, options);
  if (!reader.ok()) return reader.status();
  const auto& summary = (*reader)->summary();
  for (const auto& problem : summary.problems) {
    problems_.push_back(
        {problem.offset, {problem.status.code(), path.string() + ": " + problem.status.message()}});
  }
  const auto& s = summary.statistics;
  if (s.message_count > 0) {
    const std::int64_t start_ns = to_signed(s.message_start_time_ns);
    const std::int64_t end_ns = to_signed(s.message_end_time_ns);
    start_time_ns_ = message_count_ == 0 ? start_ns : std::min(start_time_ns_, start_ns);
    end_time_ns_ = message_count_ == 0 ? end_ns : std::max(end_time_ns_, end_ns);
  }
  message_count_ += s.message_count;
  add_topics(summary);
  files_.push_back(path);
  readers_.push_back(std::move(*reader));
  return {};
}

void BagReader::add_topics(const Summary& summary) {
  std::map<std::uint16_t, std::uint64_t> counts(summary.statistics.channel_message_counts.begin(),
                                                summary.statistics.channel_message_counts.end());
  auto& numbers = topic_numbers_.emplace_back();
  for (const auto& [id, channel] : summary.channels) {
    BagTopic topic;
    topic.name = channel.topic;
    topic.serialization_format = channel.message_encoding;
    topic.offered_qos_profiles = value_of(channel.metadata, "offered_qos_profiles");
    topic.type_description_hash = value_of(channel.metadata, "topic_type_hash");
    topic.schema_encoding.clear();
    const auto schema = summary.schemas.find(channel.schema_id);
    if (schema != summary.schemas.end()) {
      topic.type = schema->second.name;
      topic.schema_encoding = schema->second.encoding;
      topic.schema = schema->second.data;
    }
    const auto same = [&](const BagTopic& other) {
      return other.name == topic.name && other.type == topic.type &&
             other.serialization_format == topic.serialization_format;
    };
    const auto it = std::find_if(topics_.begin(), topics_.end(), same);
    numbers[id] = static_cast<std::size_t>(it - topics_.begin());
    if (it == topics_.end()) topics_.push_back(std::move(topic));
    topics_[numbers[id]].message_count += counts[id];
  }
}

/// Counts and times are those of the files; the rest is what the recorder wrote, where it did.
void BagReader::finish_metadata(bool from_file) {
  if (!from_file) {
    const auto record = readers_.back()->metadata("rosbag2");
    const auto yaml = record.ok() ? value_of(record->metadata, "serialized_metadata") : "";
    if (auto parsed = parse_bag_metadata(yaml); parsed.ok()) metadata_ = std::move(*parsed);
  }
  metadata_.message_count = message_count_;
  metadata_.starting_time_ns = start_time_ns_;
  metadata_.duration_ns = end_time_ns_ - start_time_ns_;
  metadata_.topics.clear();
  for (const auto& topic : topics_) {
    metadata_.topics.push_back({topic.name,
                                topic.type,
                                topic.serialization_format,
                                topic.offered_qos_profiles,
                                topic.type_description_hash,
                                topic.message_count});
  }
  metadata_.files.clear();
  for (std::size_t i = 0; i < files_.size(); ++i) {
    const auto& s = readers_[i]->summary().statistics;
    const std::int64_t start_ns = to_signed(s.message_start_time_ns);
    metadata_.files.push_back({files_[i].filename().string(),
                               start_ns,
                               to_signed(s.message_end_time_ns) - start_ns,
                               s.message_count});
  }
}

std::uint64_t BagReader::size() const {
  std::uint64_t size = 0;
  for (const auto& reader : readers_) size += reader->source().size();
  return size;
}

std::size_t BagReader::topic_of(std::size_t file, std::uint16_t channel_id) const {
  return topic_numbers_[file].at(channel_id);
}

BagCursor BagReader::messages(const MessageFilter& filter) const { return {*this, filter}; }

BagCursor::BagCursor(const BagReader& reader, MessageFilter filter)
    : reader_(&reader), filter_(std::move(filter)) {
  for (std::size_t i = 0; i < reader.files().size(); ++i) {
    const auto& s = reader.file(i).summary().statistics;
    const bool wanted = s.message_count > 0 && s.message_end_time_ns >= filter_.start_time_ns &&
                        s.message_start_time_ns <= filter_.end_time_ns;
    if (wanted) order_.push_back(i);
  }
  std::stable_sort(order_.begin(), order_.end(), [&](std::size_t a, std::size_t b) {
    return reader.file(a).summary().statistics.message_start_time_ns <
           reader.file(b).summary().statistics.message_start_time_ns;
  });
}

/// False when the file has no more messages (it is then closed) or cannot be read on.
bool BagCursor::advance(OpenFile& file) {
  file.message = file.cursor->next();
  if (file.message == nullptr && !file.cursor->status().ok()) {
    status_ = {file.cursor->status().code(),
               reader_->files()[file.number].string() + ": " + file.cursor->status().message()};
  }
  return file.message != nullptr;
}

bool BagCursor::open_due_files() {
  while (next_file_ < order_.size()) {
    const std::size_t number = order_[next_file_];
    const auto& reader = reader_->file(number);
    const std::uint64_t start_ns = reader.summary().statistics.message_start_time_ns;
    const bool early = std::any_of(open_.begin(), open_.end(), [start_ns](const OpenFile& file) {
      return file.message->log_time_ns < start_ns;
    });
    if (early) return true;
    ++next_file_;
    OpenFile file{number, std::make_unique<MessageCursor>(reader.messages(filter_)), nullptr};
    if (advance(file)) open_.push_back(std::move(file));
    if (!status_.ok()) return false;
  }
  return true;
}

const BagMessage* BagCursor::next() {
  if (last_) {
    const std::size_t last = *last_;
    last_.reset();
    if (!advance(open_[last])) open_.erase(open_.begin() + static_cast<std::ptrdiff_t>(last));
  }
  if (!status_.ok() || !open_due_files() || open_.empty()) return nullptr;
  const auto first =
      std::min_element(open_.begin(), open_.end(), [](const OpenFile& a, const OpenFile& b) {
        return std::pair(a.message->log_time_ns, a.number) <
               std::pair(b.message->log_time_ns, b.number);
      });
  last_ = static_cast<std::size_t>(first - open_.begin());
  const Message& message = *first->message;
  message_ = {reader_->topic_of(first->number, message.channel_id),
              to_signed(message.log_time_ns),
              to_signed(message.publish_time_ns),
              message.sequence,
              message.data};
  return &message_;
}

}  // namespace camvox::storage
