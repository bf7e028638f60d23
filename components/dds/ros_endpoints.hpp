#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "endpoints.hpp"

/// Endpoints of serialised messages on topics that ROS 2 sees: ROS types, and bytes of any type.
namespace camvox::dds {

/// Publishes serialised messages; a loan is a message on the heap.
class RosPublisher final : public PublisherBackend {
 public:
  RosPublisher(const std::shared_ptr<Participant>& participant,
               const std::string& topic,
               MessageType type,
               const PublishOptions& options);

  void* loan() override;
  void publish(void* message) override;
  void discard(void* message) noexcept override;
  [[nodiscard]] std::size_t subscriber_count() const override { return writer_.reader_count(); }
  [[nodiscard]] bool wait_for_acknowledgments(std::chrono::nanoseconds timeout) override;

 private:
  MessageType type_;
  int max_loans_;
  std::atomic<int> loans_ = 0;
  WriterHandle writer_;
};

/// Reads serialised messages.
class RosSubscription final : public SubscriptionBackend {
 public:
  RosSubscription(const std::shared_ptr<Participant>& participant,
                  const std::string& topic,
                  MessageType type,
                  const SubscribeOptions& options);

  void attach(Executor& executor,
              const std::shared_ptr<Tenant>& tenant,
              const Context::Callback& callback);
  /// Adds what this container loses, from now on, of the topic's messages on their way out; before
  /// anybody asks for the stats. Sequence numbers do not show it.
  void also_count(std::shared_ptr<const AtomicStats> exported) {
    exported_ = std::move(exported);
    lost_before_ = exported_->lost;
  }

  [[nodiscard]] SubscriptionStats stats() const override {
    SubscriptionStats stats = source_->stats.snapshot();
    if (exported_) stats.lost += exported_->lost - lost_before_;
    return stats;
  }
  [[nodiscard]] std::size_t publisher_count() const override {
    return source_->reader.writer_count();
  }

 private:
  /// Shared with the executor, which may outlive the subscription for a moment.
  struct Source {
    Source(const std::shared_ptr<Participant>& participant,
           const std::string& topic,
           MessageType message_type,
           const SubscribeOptions& options);
    bool take_one(const Context::Callback& callback);

    MessageType type;
    ReaderHandle reader;
    SequenceTracker tracker;
    AtomicStats stats;
  };
  std::shared_ptr<Source> source_;
  std::shared_ptr<const AtomicStats> exported_;
  std::uint64_t lost_before_ = 0;
};

}  // namespace camvox::dds
