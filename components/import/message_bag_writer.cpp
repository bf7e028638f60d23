#include "camvox/import/message_bag_writer.hpp"

#include <algorithm>

#include "camvox/interfaces/topics.hpp"

namespace camvox::import {

using storage::Status;
using storage::StatusCode;

storage::Result<std::unique_ptr<MessageBagWriter>> MessageBagWriter::create(
    const std::filesystem::path& folder, storage::BagWriterOptions options) {
  auto bag = storage::BagWriter::create(folder, std::move(options));
  if (!bag.ok()) return bag.status();
  return std::unique_ptr<MessageBagWriter>(new MessageBagWriter(*std::move(bag)));
}

Status MessageBagWriter::add_topic(const std::string& topic,
                                   const interfaces::MessageType& type,
                                   const interfaces::Qos& qos) {
  const auto same = std::ranges::find(topics_, topic, &WrittenTopic::name);
  if (same != topics_.end()) {
    if (same->type == type.ros_name) return {};
    return {StatusCode::kInvalid, topic + " carries " + same->type + ", not " + type.ros_name};
  }
  if (auto problem = interfaces::topics::name_problem(topic); !problem.empty()) {
    return {StatusCode::kInvalid, std::move(problem)};
  }
  storage::BagTopic added;
  added.name = topic;
  added.type = type.ros_name;
  added.schema = std::string(type.schema);
  added.offered_qos_profiles = interfaces::to_rosbag2_yaml(qos);
  added.type_description_hash = type.type_hash;
  const auto number = bag_->add_topic(std::move(added));
  if (number.ok()) topics_.push_back({topic, type.ros_name, 0, 0, 0});
  return number.status();
}

storage::Result<std::size_t> MessageBagWriter::number_of(const std::string& topic,
                                                         const interfaces::MessageType& type) {
  const bool fixed = topic == interfaces::topics::kStaticTransforms;
  const auto status = add_topic(
      topic, type, fixed ? interfaces::qos::kStaticTransformsWriter : interfaces::qos::kDefault);
  if (!status.ok()) return status;
  const auto found = std::ranges::find(topics_, topic, &WrittenTopic::name);
  return static_cast<std::size_t>(found - topics_.begin());
}

Status MessageBagWriter::write(const std::string& topic,
                               std::int64_t log_time_ns,
                               const interfaces::MessageType& type,
                               const void* message) {
  cdr_.resize(type.cdr_size(message));
  cdr_.resize(type.write_cdr(message, cdr_.data(), cdr_.size()));
  if (cdr_.empty()) {
    return {StatusCode::kInvalid, topic + ": the " + type.ros_name + " cannot be serialised"};
  }
  return write_cdr(topic, log_time_ns, type, cdr_);
}

Status MessageBagWriter::write_cdr(const std::string& topic,
                                   std::int64_t log_time_ns,
                                   const interfaces::MessageType& type,
                                   std::span<const std::uint8_t> cdr) {
  const auto number = number_of(topic, type);
  if (!number.ok()) return number.status();
  auto status = bag_->write(*number, log_time_ns, log_time_ns, std::as_bytes(cdr));
  if (!status.ok()) return status;
  auto& written = topics_[*number];
  const bool first = written.message_count++ == 0;
  written.first_time_ns = first ? log_time_ns : std::min(written.first_time_ns, log_time_ns);
  written.last_time_ns = first ? log_time_ns : std::max(written.last_time_ns, log_time_ns);
  return status;
}

}  // namespace camvox::import
