#include "camvox/storage/bag_writer.hpp"

#include <algorithm>

namespace camvox::storage {

Result<std::unique_ptr<BagWriter>> BagWriter::create(const std::filesystem::path& folder,
                                                     BagWriterOptions options) {
  auto path = folder;
  if (!path.has_filename()) path = path.parent_path();  // "name/" means "name"
  std::error_code error;
  if (path.has_parent_path()) std::filesystem::create_directories(path.parent_path(), error);
  if (!error && !std::filesystem::create_directory(path, error) && !error) {
    return Status(StatusCode::kIo, path.string() + ": exists already; choose another name");
  }
  if (error) return Status(StatusCode::kIo, path.string() + ": " + error.message());
  std::unique_ptr<BagWriter> writer(new BagWriter(path, std::move(options)));
  if (auto status = writer->open_file(); !status.ok()) return status;
  return writer;
}

BagWriter::BagWriter(std::filesystem::path folder, BagWriterOptions options)
    : folder_(std::move(folder)), options_(std::move(options)) {
  metadata_.version = options_.metadata_version;
  metadata_.custom_data = options_.custom_data;
  metadata_.ros_distro = options_.ros_distro;
}

BagWriter::~BagWriter() {
  if (writer_ && status_.ok()) (void)close().ok();
}

std::filesystem::path BagWriter::current_file() const {
  return metadata_.files.empty() ? std::filesystem::path() : folder_ / metadata_.files.back().path;
}

Metadata BagWriter::rosbag2_record() const {
  return {"rosbag2", {{"serialized_metadata", to_yaml(metadata_)}}};
}

Status BagWriter::open_file() {
  const std::string name =
      folder_.filename().string() + "_" + std::to_string(metadata_.files.size()) + ".mcap";
  auto sink = FileSink::create(folder_ / name, options_.durability);
  if (!sink.ok()) return status_ = sink.status();
  metadata_.files.push_back({name, 0, 0, 0});
  writer_ = std::make_unique<McapWriter>(options_.mcap);
  channel_ids_.clear();
  status_ = writer_->open(std::move(*sink));
  if (status_.ok()) status_ = writer_->write(rosbag2_record());
  for (const auto& topic : topics_) {
    if (status_.ok()) status_ = add_to_file(topic);
  }
  return status_;
}

Status BagWriter::close_file() {
  status_ = writer_->write(rosbag2_record());
  if (status_.ok()) status_ = writer_->close();
  writer_.reset();
  if (status_.ok()) status_ = write_bag_metadata(folder_, metadata_);
  return status_;
}

Status BagWriter::add_to_file(const BagTopic& topic) {
  const auto schema = writer_->add_schema(topic.type, topic.schema_encoding, topic.schema);
  if (!schema.ok()) return schema.status();
  const auto channel = writer_->add_channel(*schema,
                                            topic.name,
                                            topic.serialization_format,
                                            {{"offered_qos_profiles", topic.offered_qos_profiles},
                                             {"topic_type_hash", topic.type_description_hash}});
  if (!channel.ok()) return channel.status();
  channel_ids_.push_back(*channel);
  return {};
}

Result<std::size_t> BagWriter::add_topic(BagTopic topic) {
  if (!status_.ok()) return status_;
  const auto same = [&](const BagTopic& other) { return other.name == topic.name; };
  if (const auto it = std::find_if(topics_.begin(), topics_.end(), same); it != topics_.end()) {
    return Status(StatusCode::kInvalid, "topic " + topic.name + " was added already");
  }
  if (auto status = add_to_file(topic); !status.ok()) return status;
  metadata_.topics.push_back({topic.name,
                              topic.type,
                              topic.serialization_format,
                              topic.offered_qos_profiles,
                              topic.type_description_hash,
                              0});
  topics_.push_back(std::move(topic));
  return topics_.size() - 1;
}

bool BagWriter::full(std::int64_t log_time_ns) const {
  const auto& file = metadata_.files.back();
  if (file.message_count == 0) return false;
  if (options_.max_file_size > 0 && writer_->size() >= options_.max_file_size) return true;
  return options_.max_file_duration_ns > 0 && log_time_ns > file.starting_time_ns &&
         static_cast<std::uint64_t>(log_time_ns - file.starting_time_ns) >=
             options_.max_file_duration_ns;
}

void BagWriter::count(std::size_t topic, std::int64_t log_time_ns) {
  const auto extend = [log_time_ns](auto& span) {
    const std::int64_t end_ns =
        std::max(span.message_count == 0 ? log_time_ns : span.starting_time_ns + span.duration_ns,
                 log_time_ns);
    span.starting_time_ns =
        span.message_count == 0 ? log_time_ns : std::min(span.starting_time_ns, log_time_ns);
    span.duration_ns = end_ns - span.starting_time_ns;
    ++span.message_count;
  };
  extend(metadata_);
  extend(metadata_.files.back());
  ++metadata_.topics[topic].message_count;
}

Status BagWriter::write(std::size_t topic,
                        std::int64_t log_time_ns,
                        std::int64_t publish_time_ns,
                        Bytes data,
                        std::uint32_t sequence) {
  if (!status_.ok()) return status_;
  if (topic >= topics_.size()) return {StatusCode::kInvalid, "no topic of this number was added"};
  if (log_time_ns < 0 || publish_time_ns < 0) {
    return {StatusCode::kInvalid, "message on " + topics_[topic].name + " is from before 1970"};
  }
  if (full(log_time_ns)) {
    if (auto status = split(); !status.ok()) return status;
  }
  auto status = writer_->write(Message{channel_ids_[topic],
                                       sequence,
                                       static_cast<std::uint64_t>(log_time_ns),
                                       static_cast<std::uint64_t>(publish_time_ns),
                                       data});
  if (status.ok()) count(topic, log_time_ns);
  if (!writer_->status().ok()) status_ = status;
  return status;
}

Status BagWriter::split() {
  if (!status_.ok()) return status_;
  const auto closed = current_file();
  if (auto status = close_file(); !status.ok()) return status;
  if (auto status = open_file(); !status.ok()) return status;
  if (on_split) on_split(closed, current_file());
  return {};
}

Status BagWriter::flush() {
  if (!status_.ok()) return status_;
  return status_ = writer_->flush();
}

Status BagWriter::close() {
  if (!status_.ok()) return status_;
  auto status = close_file();
  if (status.ok()) status_ = {StatusCode::kInvalid, "the bag is closed"};
  return status;
}

}  // namespace camvox::storage
