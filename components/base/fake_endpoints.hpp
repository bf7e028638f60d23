#pragma once

#include <atomic>
#include <deque>
#include <map>
#include <mutex>

#include "camvox/component/context.hpp"

/// The two ends that FakeContext gives a component.
namespace camvox {

/// A message as a component gets it: default values, but junk in the rows of a plain one's lists.
[[nodiscard]] std::shared_ptr<void> make_unclean_message(const MessageType& type);

/// Keeps what is published; lends out `max_loans` messages at a time. Thread-safe.
class FakePublisher final : public PublisherBackend {
 public:
  FakePublisher(std::string port, MessageType type, bool raw, int max_loans);

  void* loan() override;
  void publish(void* message) override;
  void discard(void* message) noexcept override;
  [[nodiscard]] std::size_t subscriber_count() const override { return subscribers_; }

  [[nodiscard]] const MessageType& type() const { return type_; }
  [[nodiscard]] bool raw() const { return raw_; }
  void set_subscriber_count(std::size_t count) { subscribers_ = count; }
  [[nodiscard]] std::vector<std::shared_ptr<const void>> published() const;
  void forget();
  [[nodiscard]] std::size_t outstanding() const;
  [[nodiscard]] std::size_t discarded() const;

 private:
  [[nodiscard]] std::shared_ptr<void> take_back(void* message);

  std::string port_;
  MessageType type_;
  bool raw_;
  std::size_t max_loans_;
  std::atomic<std::size_t> subscribers_ = 1;
  mutable std::mutex mutex_;
  std::map<void*, std::shared_ptr<void>> lent_;
  std::vector<std::shared_ptr<const void>> published_;
  std::size_t discarded_ = 0;
};

/// Calls the component back, or queues while it holds too many samples.
class FakeSubscription final : public SubscriptionBackend {
 public:
  FakeSubscription(MessageType type,
                   bool raw,
                   Context::Callback callback,
                   SubscribeOptions options);

  /// Queues a message, at the cost of the oldest one when the queue is full.
  void push(std::shared_ptr<void> message, std::int64_t now_ns);
  /// Calls back with what is queued until the component holds too much.
  void deliver();

  [[nodiscard]] SubscriptionStats stats() const override { return stats_; }
  [[nodiscard]] std::size_t publisher_count() const override { return 1; }
  [[nodiscard]] const MessageType& type() const { return type_; }
  [[nodiscard]] bool raw() const { return raw_; }
  [[nodiscard]] const Qos& qos() const { return options_.qos; }
  [[nodiscard]] int held() const { return *held_; }
  [[nodiscard]] std::size_t waiting() const { return queue_.size(); }

 private:
  struct Queued {
    std::shared_ptr<void> message;
    MessageInfo info;
  };
  [[nodiscard]] bool starved() const { return *held_ > options_.max_held; }

  MessageType type_;
  bool raw_;
  Context::Callback callback_;
  SubscribeOptions options_;
  // Shared with the samples, which may outlive the context.
  std::shared_ptr<std::atomic<int>> held_ = std::make_shared<std::atomic<int>>(0);
  std::deque<Queued> queue_;
  std::uint64_t sent_ = 0;
  std::uint64_t lost_since_delivery_ = 0;
  SubscriptionStats stats_;
};

}  // namespace camvox
