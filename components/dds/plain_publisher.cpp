#include "plain_publisher.hpp"

#include <fmt/format.h>

#include "camvox/dds/shared_memory.hpp"
#include "topic_types.hpp"

namespace camvox::dds {
namespace {

using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// Shared memory is taken as it is first touched, and when there is none left the process dies of
/// SIGBUS; so all that the topic may ever need must be there at the start.
void require_shared_memory(const std::string& topic, const MessageType& type, int samples) {
  const std::uint64_t needed = static_cast<std::uint64_t>(samples) * type.size;
  const std::uint64_t free = free_shared_memory_bytes();
  if (free >= needed) return;
  throw std::runtime_error(fmt::format(
      "topic {}: zero_copy: interprocess needs {} MiB of shared memory ({} samples of {}), "
      "/dev/shm "
      "has {} MiB free. Enlarge it (mount -o remount,size=..., docker run --shm-size=...) or leave "
      "zero_copy out",
      topic,
      (needed >> 20) + 1,
      samples,
      type.ros_name,
      free >> 20));
}

std::unique_ptr<WriterHandle> make_shared_writer(const std::shared_ptr<Participant>& participant,
                                                 const std::string& topic,
                                                 const MessageType& type,
                                                 const PublishOptions& options,
                                                 const TopicSettings& settings) {
  if (!settings.interprocess_zero_copy) return nullptr;
  if (options.qos.latched) {
    throw std::runtime_error("topic " + topic +
                             ": a latched topic cannot be zero_copy: interprocess");
  }
  require_shared_memory(topic, type, options.qos.depth + kSharedExtraSamples);
  return std::make_unique<WriterHandle>(participant,
                                        shared_topic_name(topic),
                                        make_plain_topic_type(type),
                                        shared_writer_qos(options.qos, settings.max_blocking));
}

}  // namespace

PlainPublisher::PlainPublisher(std::shared_ptr<Participant> participant,
                               const std::string& topic,
                               const MessageType& type,
                               const PublishOptions& options,
                               const TopicSettings& settings)
    : topic_(topic),
      type_(type),
      max_loans_(options.max_loans),
      max_blocking_(settings.max_blocking),
      in_place_(
          std::make_unique<WriterHandle>(participant,
                                         in_place_topic_name(*participant, topic),
                                         make_plain_topic_type(type),
                                         in_place_writer_qos(options.qos, options.max_loans))),
      shared_(make_shared_writer(participant, topic, type, options, settings)) {}

PlainPublisher::~PlainPublisher() {
  if (unsent_loan_ != nullptr) (*shared_)->discard_loan(unsent_loan_);
}

bool PlainPublisher::shared_is_read() const { return shared_ && shared_->reader_count() > 0; }

std::size_t PlainPublisher::subscriber_count() const {
  return in_place_->reader_count() + (shared_ ? shared_->reader_count() : 0);
}

void* PlainPublisher::loan_from(WriterHandle& writer) {
  void* message = nullptr;
  if (writer->loan_sample(message) != ReturnCode::RETCODE_OK) {
    throw LoanError(fmt::format("topic {}: no free sample; its readers hold all of them", topic_));
  }
  return message;
}

void* PlainPublisher::loan() {
  const std::lock_guard lock(mutex_);
  if (static_cast<int>(in_place_loans_.size() + shared_loans_.size()) >= max_loans_) {
    throw LoanError(fmt::format(
        "topic {}: {} loans are out, as many as PublishOptions::max_loans allows; publish or drop "
        "one first",
        topic_,
        max_loans_));
  }
  void* message = nullptr;
  if (shared_is_read()) {
    message = unsent_loan_ != nullptr ? std::exchange(unsent_loan_, nullptr) : loan_from(*shared_);
    shared_loans_.insert(message);
  } else {
    message = loan_from(*in_place_);
    in_place_loans_.insert(message);
  }
  type_.reset(message);
  return message;
}

void PlainPublisher::copy_to(WriterHandle& writer, const void* message) {
  void* copy = loan_from(writer);
  type_.copy(message, copy);
  if (writer->write(copy, eprosima::fastrtps::rtps::InstanceHandle_t()) != ReturnCode::RETCODE_OK) {
    writer->discard_loan(copy);
    ++*unsent_;
  }
}

void PlainPublisher::publish_in_place(void* message, std::int64_t publish_stamp_ns) {
  if (shared_is_read()) copy_to(*shared_, message);
  auto parameters = write_parameters(publish_stamp_ns);
  if (!(*in_place_)->write(message, parameters)) {
    (*in_place_)->discard_loan(message);
    ++*unsent_;
  }
}

void PlainPublisher::publish_shared(void* message) {
  if (in_place_->reader_count() > 0) copy_to(*in_place_, message);
  const auto deadline = std::chrono::steady_clock::now() + max_blocking_;
  do {  // write() may time out early; the bound is ours
    const auto code = (*shared_)->write(message, eprosima::fastrtps::rtps::InstanceHandle_t());
    if (code == ReturnCode::RETCODE_OK) return;
    if (code != ReturnCode::RETCODE_TIMEOUT) break;
  } while (std::chrono::steady_clock::now() < deadline);
  // Kept for the next loan: giving it back would let the pool reuse a sample that is being read.
  ++*unsent_;
  const std::lock_guard lock(mutex_);
  if (unsent_loan_ == nullptr) {
    unsent_loan_ = message;
  } else {
    (*shared_)->discard_loan(message);
  }
}

void PlainPublisher::publish_as_of(void* message, std::int64_t publish_stamp_ns) {
  if (!type_.counters_valid(message)) {
    discard(message);
    throw std::logic_error(fmt::format(
        "topic {}: a counter of {} is over the capacity of its list", topic_, type_.ros_name));
  }
  bool in_shared_memory = false;
  {
    const std::lock_guard lock(mutex_);
    in_shared_memory = shared_loans_.erase(message) > 0;
    in_place_loans_.erase(message);
  }
  if (in_shared_memory) {
    publish_shared(message);
  } else {
    publish_in_place(message, publish_stamp_ns);
  }
}

void PlainPublisher::discard(void* message) noexcept {
  const std::lock_guard lock(mutex_);
  if (shared_loans_.erase(message) > 0) {
    if (unsent_loan_ == nullptr) {
      unsent_loan_ = message;
    } else {
      (*shared_)->discard_loan(message);
    }
  } else if (in_place_loans_.erase(message) > 0) {
    (*in_place_)->discard_loan(message);
  }
}

}  // namespace camvox::dds
