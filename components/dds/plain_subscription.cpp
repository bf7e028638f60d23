#include "plain_subscription.hpp"

#include <fmt/format.h>

#include <fastdds/dds/core/LoanableSequence.hpp>

#include "topic_types.hpp"

namespace camvox::dds {
namespace {

using ReturnCode = eprosima::fastrtps::types::ReturnCode_t;

/// A sample on loan from a reader; goes back when destroyed, on any thread.
struct HeldSample {
  HeldSample(std::shared_ptr<ReaderHandle> owner, std::shared_ptr<Starvation> state)
      : reader(std::move(owner)), starvation(std::move(state)) {}
  HeldSample(const HeldSample&) = delete;
  HeldSample& operator=(const HeldSample&) = delete;
  ~HeldSample() {
    if (data.length() == 0) return;
    (*reader)->return_loan(data, infos);
    if (starvation->starved.exchange(false)) starvation->wake();
  }
  /// Taking by bytes keeps this independent of the message's type: a loan is only a pointer.
  [[nodiscard]] const void* message() const { return data.buffer()[0]; }

  std::shared_ptr<ReaderHandle> reader;
  std::shared_ptr<Starvation> starvation;
  eprosima::fastdds::dds::LoanableSequence<std::uint8_t> data;
  eprosima::fastdds::dds::SampleInfoSeq infos;
};

}  // namespace

bool PlainSource::take_one(const Context::Callback& callback) {
  auto held = std::make_shared<HeldSample>(reader_, starvation_);
  auto code = (*reader_)->take(held->data, held->infos, 1);
  if (code == ReturnCode::RETCODE_OUT_OF_RESOURCES) {
    ++stats_->starved;
    starvation_->starved = true;
    // A sample may have come back just before that was said: nobody would wake us.
    code = (*reader_)->take(held->data, held->infos, 1);
  }
  if (code != ReturnCode::RETCODE_OK) return false;
  const auto& info = held->infos[0];
  if (!info.valid_data) return true;  // the end of a writer, not a message
  if (reader_->from_this_participant(info) != from_this_process_ ||
      !type_.counters_valid(held->message())) {
    ++stats_->rejected;
    return true;
  }
  const MessageInfo message = tracker_.track(info);
  stats_->count(message);
  callback(std::shared_ptr<const void>(held, held->message()), message);
  return true;
}

PlainSubscription::PlainSubscription(const std::shared_ptr<Participant>& participant,
                                     const std::string& topic,
                                     const MessageType& type,
                                     const SubscribeOptions& options)
    : type_(type),
      in_place_(std::make_shared<PlainSource>(
          // +1: the sample that the callback is looking at
          std::make_shared<ReaderHandle>(participant,
                                         in_place_topic_name(*participant, topic),
                                         make_plain_topic_type(type),
                                         in_place_reader_qos(options.qos, options.max_held + 1)),
          type,
          true,
          stats_)) {}

void PlainSubscription::add_shared(const std::shared_ptr<Participant>& participant,
                                   const std::string& topic,
                                   const SubscribeOptions& options) {
  if (options.max_held > kSharedMaxHeld) {
    throw std::runtime_error(
        fmt::format("topic {}: zero_copy: interprocess lets a subscription hold {} samples, not {}",
                    topic,
                    kSharedMaxHeld,
                    options.max_held));
  }
  shared_ = std::make_shared<PlainSource>(
      std::make_shared<ReaderHandle>(participant,
                                     shared_topic_name(topic),
                                     make_plain_topic_type(type_),
                                     shared_reader_qos(options.qos, options.max_held + 1)),
      type_,
      false,
      stats_);
}

void PlainSubscription::attach(Executor& executor,
                               const std::shared_ptr<Tenant>& tenant,
                               const Context::Callback& callback) {
  for (const auto& source : {in_place_, shared_}) {
    if (!source) continue;
    source->set_waker(executor.waker());
    executor.add_source(tenant, source->reader().data_condition(), [source, callback] {
      return source->take_one(callback);
    });
  }
}

SubscriptionStats PlainSubscription::stats() const {
  SubscriptionStats stats = stats_->snapshot();
  stats.lost += border_stats_->lost;
  stats.rejected += border_stats_->rejected;
  return stats;
}

std::size_t PlainSubscription::publisher_count() const {
  return in_place_->reader().writer_count() + (shared_ ? shared_->reader().writer_count() : 0);
}

}  // namespace camvox::dds
