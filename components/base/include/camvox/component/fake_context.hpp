#pragma once

#include <concepts>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <type_traits>

#include "camvox/component/context.hpp"

namespace camvox {

class FakePublisher;
class FakeSubscription;

/// A Context for unit tests of one component: no middleware, no threads, a clock that only the test
/// moves. Messages go in through `send`, what the component published comes out of `published`:
///
///     FakeContext fake;
///     fake.set_parameter("min_range_m", 0.5);
///     DeskewComponent component(fake);
///     fake.send<Scan>("scan", [](Scan& scan) { scan.points_count() = 1; });
///     EXPECT_EQ(fake.published<Cloud>("cloud").back()->points_count(), 1);
///
/// Ports are named as the component names them. Callbacks run inside `send`, `advance` and
/// `run_posted`, and what they throw reaches the test. Loans come from a pool of `max_loans`, and a
/// component that keeps more than `max_held` samples gets no more, as in the container. The rows of
/// a new message's lists hold junk, as those of a reused loan do. Mistakes in the test itself (an
/// unknown port, another type) throw std::logic_error. The context must outlive the component.
class FakeContext final : public Context {
 public:
  struct LogEntry {
    LogLevel level = LogLevel::kInfo;
    std::string text;
  };

  explicit FakeContext(std::string name = "component");
  ~FakeContext() override;

  /// Gives a parameter, before the component is made.
  void set_parameter(std::string_view key, config::Value value);
  /// What topic_of() tells of a port; its default topic unless set.
  void set_topic_of(std::string_view port, std::string topic) {
    remap_.insert_or_assign(std::string(port), std::move(topic));
  }
  /// What earlier_runs() tells the component, which is made after; 0 unless set.
  void set_earlier_runs(std::uint64_t count) { earlier_runs_ = count; }
  /// Changes parameters as `camvox param set` does. Returns what is wrong; then nothing changed.
  [[nodiscard]] std::vector<config::Problem> change_parameters(const config::ParameterMap& changes);
  [[nodiscard]] const config::ParameterMap& effective_parameters() const { return effective_; }

  /// Delivers a copy of the message to the component's input.
  template <typename T>
  void send(std::string_view port, const T& message) {
    send_copy(port, type_of<T>(), &message);
  }
  /// Delivers what another component published, the message itself.
  template <typename T>
  void pass_on(std::string_view port, const std::shared_ptr<const T>& message) {
    require_input(port, type_of<T>());
    deliver(port, std::const_pointer_cast<T>(message));
  }
  /// Delivers a message that `fill` writes in place; for large ones.
  template <typename T, std::invocable<T&> Fill>
  void send(std::string_view port, Fill&& fill) {
    auto message = new_input(port, type_of<T>());
    fill(*static_cast<T*>(message.get()));
    deliver(port, std::move(message));
  }

  /// Calls a service of the component and returns what it answers.
  template <typename Request, typename Response>
  [[nodiscard]] Response call(std::string_view port, const Request& request) {
    Response response;
    service(port, type_of<Request>(), type_of<Response>())(&request, &response);
    return response;
  }

  /// All that the component published on an output, oldest first.
  template <typename T>
  [[nodiscard]] std::vector<std::shared_ptr<const T>> published(std::string_view port) const {
    std::vector<std::shared_ptr<const T>> messages;
    for (auto& message : published_on(port, type_of<T>())) {
      messages.push_back(std::static_pointer_cast<const T>(std::move(message)));
    }
    return messages;
  }

  /// The same, and forgets them: for chains of components that run for long.
  template <typename T>
  [[nodiscard]] std::vector<std::shared_ptr<const T>> take_published(std::string_view port) {
    auto messages = published<T>(port);
    forget_published(port);
    return messages;
  }

  /// Moves the clock on and fires the timers that become due, in order of time, with now_ns() at
  /// the moment each is due.
  void advance(std::chrono::nanoseconds duration);
  /// Sets the clock without firing timers.
  void set_now_ns(std::int64_t now_ns) { now_ns_ = now_ns; }
  /// Runs what was posted so far and returns how much that was. With a `patience`, first waits that
  /// long at most for another thread to post something.
  std::size_t run_posted(std::chrono::milliseconds patience = {});

  [[nodiscard]] std::vector<LogEntry> log_entries() const;
  /// What topics() lists; nothing unless set.
  void set_topics(std::vector<TopicDescription> topics) { topics_ = std::move(topics); }
  /// What subscriber_count() tells of an output; 1 unless set.
  void set_subscriber_count(std::string_view port, std::size_t count);

  [[nodiscard]] std::size_t outstanding_loans(std::string_view port) const;
  [[nodiscard]] std::size_t discarded_loans(std::string_view port) const;
  [[nodiscard]] SubscriptionStats subscription_stats(std::string_view port) const;
  [[nodiscard]] Qos subscription_qos(std::string_view port) const;
  /// Throws std::logic_error naming every loan that is neither published nor dropped, every sample
  /// that is still held or waits, and work that was posted but not run. For the end of a test.
  void verify_nothing_left() const;

  [[nodiscard]] const std::string& name() const override { return name_; }
  [[nodiscard]] std::uint64_t earlier_runs() const override { return earlier_runs_; }
  [[nodiscard]] Logger& log() override;
  [[nodiscard]] Diagnostics& diagnostics() override { return diagnostics_; }
  [[nodiscard]] std::int64_t now_ns() const override { return now_ns_; }
  [[nodiscard]] std::string topic_of(const Port& port) const override;
  [[nodiscard]] std::vector<TopicDescription> topics() const override { return topics_; }
  void every(std::chrono::nanoseconds period, std::function<void()> callback) override;
  void post(std::function<void()> callback) override;
  void request_exit() override { exit_requested_ = true; }
  [[nodiscard]] bool exit_requested() const { return exit_requested_; }
  /// A restart is another component on another context that was given this.
  [[nodiscard]] std::any* restart_memory() override { return &restart_memory_; }
  [[nodiscard]] bool all_idle() const override { return all_idle_; }
  /// What all_idle() tells; true unless set.
  void set_all_idle(bool idle) { all_idle_ = idle; }

 protected:
  [[nodiscard]] const config::ParameterMap& given_parameters() const override { return given_; }
  void accept_parameters(config::ParameterMap effective,
                         std::vector<config::Problem> problems) override;
  void accept_changes(ChangeHandler handler) override { change_handler_ = std::move(handler); }
  std::shared_ptr<PublisherBackend> make_publisher(const Port& port,
                                                   const MessageType& type,
                                                   const PublishOptions& options) override;
  Subscription make_subscription(const Port& port,
                                 const MessageType& type,
                                 Callback callback,
                                 const SubscribeOptions& options) override;
  std::shared_ptr<PublisherBackend> make_raw_publisher(const Port& port,
                                                       std::string_view type_name,
                                                       const PublishOptions& options) override;
  Subscription make_raw_subscription(const Port& port,
                                     std::string_view type_name,
                                     Callback callback,
                                     const SubscribeOptions& options) override;
  void make_service(const Port& port,
                    const MessageType& request,
                    const MessageType& response,
                    ServiceHandler handler) override;

 private:
  class CapturingLogger;
  struct Timer {
    std::int64_t due_ns = 0;
    std::int64_t period_ns = 0;
    std::function<void()> callback;
  };

  /// Null stands for serialised messages of any type.
  template <typename T>
  [[nodiscard]] static const MessageType* type_of() {
    if constexpr (std::is_same_v<T, RawMessage>) {
      return nullptr;
    } else {
      return &interfaces::message_type<T>();
    }
  }

  [[nodiscard]] std::shared_ptr<void> new_input(std::string_view port, const MessageType* type);
  void send_copy(std::string_view port, const MessageType* type, const void* message);
  void require_input(std::string_view port, const MessageType* type) const;
  void forget_published(std::string_view port);
  void deliver(std::string_view port, std::shared_ptr<void> message);
  void deliver_waiting();
  [[nodiscard]] std::vector<std::shared_ptr<const void>> published_on(
      std::string_view port, const MessageType* type) const;
  [[nodiscard]] FakePublisher& output(std::string_view port) const;
  [[nodiscard]] FakeSubscription& input(std::string_view port) const;
  [[nodiscard]] const ServiceHandler& service(std::string_view port,
                                              const MessageType* request,
                                              const MessageType* response) const;
  [[nodiscard]] Timer* next_due(std::int64_t until_ns);

  std::string name_;
  std::int64_t now_ns_;
  std::uint64_t earlier_runs_ = 0;
  bool exit_requested_ = false;
  bool all_idle_ = true;
  std::any restart_memory_;
  config::ParameterMap given_;
  config::ParameterMap effective_;
  ChangeHandler change_handler_;
  std::unique_ptr<CapturingLogger> log_;
  Diagnostics diagnostics_;
  std::map<std::string, std::string, std::less<>> remap_;
  std::vector<TopicDescription> topics_;
  std::map<std::string, std::shared_ptr<FakePublisher>, std::less<>> outputs_;
  std::map<std::string, std::shared_ptr<FakeSubscription>, std::less<>> inputs_;
  struct Service {
    const MessageType* request = nullptr;
    const MessageType* response = nullptr;
    ServiceHandler handler;
  };
  std::map<std::string, std::unique_ptr<Service>, std::less<>> services_;
  std::deque<Timer> timers_;
  mutable std::mutex posted_mutex_;
  std::condition_variable posted_something_;
  std::deque<std::function<void()>> posted_;
};

}  // namespace camvox
