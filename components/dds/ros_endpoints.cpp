#include "ros_endpoints.hpp"

#include <fmt/format.h>

#include "topic_types.hpp"

namespace camvox::dds {
namespace {

using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

MessageType under_name(MessageType type, const std::string& type_name) {
  return type_name.empty() ? type : interfaces::renamed(type, type_name);
}

}  // namespace

RosPublisher::RosPublisher(const std::shared_ptr<Participant>& participant,
                           const std::string& topic,
                           MessageType type,
                           const PublishOptions& options)
    : type_(under_name(std::move(type), options.type_name)),
      max_loans_(options.max_loans),
      writer_(participant,
              wire_topic_name(topic),
              new WireTopicType(type_.dds_name),
              wire_writer_qos(options.qos)) {}

void* RosPublisher::loan() {
  if (++loans_ > max_loans_) {
    --loans_;
    throw LoanError(fmt::format(
        "{}: {} loans are out, as many as PublishOptions::max_loans allows; publish or drop one "
        "first",
        type_.ros_name,
        max_loans_));
  }
  return type_.create();
}

void RosPublisher::publish(void* message) {
  WireData data{&type_, message};
  const bool sent = writer_->write(&data);
  discard(message);
  if (!sent) throw std::logic_error(fmt::format("{}: invalid message not sent", type_.ros_name));
}

void RosPublisher::discard(void* message) noexcept {
  type_.destroy(message);
  --loans_;
}

bool RosPublisher::wait_for_acknowledgments(std::chrono::nanoseconds timeout) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  const eprosima::fastrtps::Duration_t duration(
      static_cast<std::int32_t>(timeout.count() / kSecond_ns),
      static_cast<std::uint32_t>(timeout.count() % kSecond_ns));
  return writer_->wait_for_acknowledgments(duration) == ReturnCode::RETCODE_OK;
}

RosSubscription::Source::Source(const std::shared_ptr<Participant>& participant,
                                const std::string& topic,
                                MessageType message_type,
                                const SubscribeOptions& options)
    : type(under_name(std::move(message_type), options.type_name)),
      reader(participant,
             wire_topic_name(topic),
             new WireTopicType(type.dds_name),
             wire_reader_qos(options.qos)) {}

bool RosSubscription::Source::take_one(const Context::Callback& callback) {
  const std::shared_ptr<void> message(type.create(), type.destroy);
  WireData data{&type, message.get()};
  eprosima::fastdds::dds::SampleInfo info;
  if (reader->take_next_sample(&data, &info) != ReturnCode::RETCODE_OK) return false;
  if (!info.valid_data) return true;  // the end of a writer, not a message
  const MessageInfo message_info = tracker.track(info);
  if (!data.well_formed) {
    ++stats.rejected;
    return true;
  }
  stats.count(message_info);
  callback(message, message_info);
  return true;
}

RosSubscription::RosSubscription(const std::shared_ptr<Participant>& participant,
                                 const std::string& topic,
                                 MessageType type,
                                 const SubscribeOptions& options)
    : source_(std::make_shared<Source>(participant, topic, std::move(type), options)) {}

void RosSubscription::attach(Executor& executor,
                             const std::shared_ptr<Tenant>& tenant,
                             const Context::Callback& callback) {
  executor.add_source(tenant, source_->reader.data_condition(), [source = source_, callback] {
    return source->take_one(callback);
  });
}

}  // namespace camvox::dds
