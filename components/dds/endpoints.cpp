#include "endpoints.hpp"

#include <fastdds/dds/core/condition/StatusCondition.hpp>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <sstream>
#include <stdexcept>

namespace camvox::dds {
namespace {

namespace fdds = eprosima::fastdds::dds;
using eprosima::fastrtps::rtps::iHandle2GUID;

void set_limits(fdds::ResourceLimitsQosPolicy& limits, int samples, int extra) {
  limits.max_instances = 1;
  limits.max_samples = samples;
  limits.max_samples_per_instance = samples;
  limits.allocated_samples = std::min(samples, 2);
  limits.extra_samples = extra;
}

template <typename EndpointQos>
EndpointQos common_qos(const Qos& qos) {
  EndpointQos endpoint;
  endpoint.reliability().kind =
      qos.reliable ? fdds::RELIABLE_RELIABILITY_QOS : fdds::BEST_EFFORT_RELIABILITY_QOS;
  endpoint.durability().kind =
      qos.latched ? fdds::TRANSIENT_LOCAL_DURABILITY_QOS : fdds::VOLATILE_DURABILITY_QOS;
  endpoint.history().kind = fdds::KEEP_LAST_HISTORY_QOS;
  endpoint.history().depth = qos.depth;
  endpoint.data_sharing().off();
  return endpoint;
}

eprosima::fastrtps::Duration_t to_duration(std::chrono::milliseconds time) {
  return {static_cast<std::int32_t>(time.count() / 1000),
          static_cast<std::uint32_t>(time.count() % 1000 * 1'000'000)};
}

/// Enters an endpoint of ours in the participant's list; returns its GUID.
template <typename Endpoint>
std::string announce(Participant& participant,
                     const fdds::Topic& topic,
                     const Endpoint& endpoint,
                     bool is_writer) {
  std::ostringstream guid;
  guid << endpoint.guid();
  DiscoveredEndpoint entry;
  entry.topic_name = topic.get_name();
  entry.type_name = topic.get_type_name();
  entry.guid = guid.str();
  entry.is_writer = is_writer;
  entry.reliable = endpoint.get_qos().reliability().kind == fdds::RELIABLE_RELIABILITY_QOS;
  entry.latched = endpoint.get_qos().durability().kind != fdds::VOLATILE_DURABILITY_QOS;
  participant.add_own_endpoint(entry);
  return entry.guid;
}

}  // namespace

fdds::DataWriterQos in_place_writer_qos(const Qos& qos, int loans) {
  auto writer = common_qos<fdds::DataWriterQos>({qos.depth, true, qos.latched});
  set_limits(writer.resource_limits(), qos.depth, loans + 1);
  return writer;
}

fdds::DataReaderQos in_place_reader_qos(const Qos& qos, int held) {
  auto reader = common_qos<fdds::DataReaderQos>({qos.depth, true, qos.latched});
  set_limits(reader.resource_limits(), qos.depth + held + 1, 0);
  return reader;
}

fdds::DataWriterQos shared_writer_qos(const Qos& qos, std::chrono::milliseconds max_blocking) {
  auto writer = common_qos<fdds::DataWriterQos>({qos.depth, true, false});
  writer.history().kind = fdds::KEEP_ALL_HISTORY_QOS;
  writer.data_sharing().on("");
  writer.reliability().max_blocking_time = to_duration(max_blocking);
  set_limits(writer.resource_limits(), qos.depth, kSharedExtraSamples);
  return writer;
}

fdds::DataReaderQos shared_reader_qos(const Qos& qos, int held) {
  auto reader = common_qos<fdds::DataReaderQos>({qos.depth, true, false});
  reader.history().kind = fdds::KEEP_ALL_HISTORY_QOS;
  reader.data_sharing().on("");
  set_limits(reader.resource_limits(), qos.depth + held + 1, 0);
  return reader;
}

fdds::DataWriterQos wire_writer_qos(const Qos& qos) {
  auto writer = common_qos<fdds::DataWriterQos>(qos);
  set_limits(writer.resource_limits(), qos.depth, 2);
  writer.publish_mode().kind = fdds::ASYNCHRONOUS_PUBLISH_MODE;
  writer.endpoint().history_memory_policy =
      eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return writer;
}

fdds::DataReaderQos wire_reader_qos(const Qos& qos) {
  auto reader = common_qos<fdds::DataReaderQos>(qos);
  set_limits(reader.resource_limits(), qos.depth + 1, 0);
  reader.endpoint().history_memory_policy =
      eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return reader;
}

WriterHandle::WriterHandle(std::shared_ptr<Participant> participant,
                           const std::string& topic_name,
                           fdds::TopicDataType* type,
                           const fdds::DataWriterQos& qos,
                           std::function<void()> on_match_change)
    : participant_(std::move(participant)),
      topic_(participant_->topic(topic_name, type)),
      on_match_change_(std::move(on_match_change)) {
  writer_ = participant_->publisher()->create_datawriter(
      topic_.get(), qos, this, fdds::StatusMask::publication_matched());
  if (writer_ == nullptr) throw std::runtime_error("DDS refused a writer for " + topic_name);
  guid_ = announce(*participant_, *topic_, *writer_, true);
}

WriterHandle::~WriterHandle() {
  participant_->remove_own_endpoint(guid_);
  writer_->set_listener(nullptr);
  participant_->publisher()->delete_datawriter(writer_);
}

void WriterHandle::on_publication_matched(fdds::DataWriter*,
                                          const fdds::PublicationMatchedStatus& status) {
  {
    const std::lock_guard lock(matched_mutex_);
    if (status.current_count_change > 0) {
      matched_.insert(status.last_subscription_handle);
    } else {
      matched_.erase(status.last_subscription_handle);
    }
    // Not status.current_count: one reader's end and another's begin are told by two threads, in
    // any order.
    readers_ = matched_.size();
  }
  if (on_match_change_) on_match_change_();
}

bool WriterHandle::matches(const eprosima::fastrtps::rtps::GUID_t& reader) const {
  const std::lock_guard lock(matched_mutex_);
  return matched_.contains(eprosima::fastrtps::rtps::InstanceHandle_t(reader));
}

ReaderHandle::ReaderHandle(std::shared_ptr<Participant> participant,
                           const std::string& topic_name,
                           fdds::TopicDataType* type,
                           const fdds::DataReaderQos& qos)
    : participant_(std::move(participant)), topic_(participant_->topic(topic_name, type)) {
  reader_ = participant_->subscriber()->create_datareader(topic_.get(), qos);
  if (reader_ == nullptr) throw std::runtime_error("DDS refused a reader for " + topic_name);
  reader_->get_statuscondition().set_enabled_statuses(fdds::StatusMask::data_available());
  guid_ = announce(*participant_, *topic_, *reader_, false);
}

ReaderHandle::~ReaderHandle() {
  participant_->remove_own_endpoint(guid_);
  participant_->subscriber()->delete_datareader(reader_);
}

fdds::Condition* ReaderHandle::data_condition() const { return &reader_->get_statuscondition(); }

std::size_t ReaderHandle::writer_count() const {
  fdds::SubscriptionMatchedStatus status;
  reader_->get_subscription_matched_status(status);
  return static_cast<std::size_t>(std::max(0, status.current_count));
}

bool ReaderHandle::from_this_participant(const fdds::SampleInfo& info) const {
  return iHandle2GUID(info.publication_handle).guidPrefix == reader_->guid().guidPrefix;
}

MessageInfo SequenceTracker::track(const fdds::SampleInfo& info) {
  const auto sequence =
      static_cast<std::uint64_t>(info.sample_identity.sequence_number().to64long());
  MessageInfo message;
  message.publish_stamp_ns = info.source_timestamp.to_ns();
  message.sequence = sequence;
  const auto [entry, first] = last_of_writer_.try_emplace(info.publication_handle, sequence);
  if (!first) {
    if (sequence > entry->second + 1) message.lost_before = sequence - entry->second - 1;
    entry->second = std::max(entry->second, sequence);
  }
  return message;
}

eprosima::fastrtps::rtps::WriteParams write_parameters(std::int64_t publish_stamp_ns) {
  eprosima::fastrtps::rtps::WriteParams parameters;
  if (publish_stamp_ns > 0) parameters.source_timestamp().from_ns(publish_stamp_ns);
  return parameters;
}

std::string in_place_topic_name(const Participant& participant, const std::string& topic) {
  return "in/" + participant.unique_token() + topic;
}

std::string shared_topic_name(const std::string& topic) { return "shared" + topic; }

std::string wire_topic_name(const std::string& topic) { return "rt" + topic; }

}  // namespace camvox::dds
