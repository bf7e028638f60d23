#include "camvox/component/fake_context.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "camvox/component/raw_message.hpp"
#include "fake_endpoints.hpp"

namespace camvox {
namespace {

constexpr std::int64_t kFirstNowNs = 1'700'000'000'000'000'000;  // any moment but 0

template <typename Ports>
auto& find_port(const Ports& ports, std::string_view kind, std::string_view name) {
  const auto found = ports.find(name);
  if (found != ports.end()) return *found->second;
  std::vector<std::string> known;
  for (const auto& [port, endpoint] : ports) known.push_back(port);
  throw std::logic_error(fmt::format(
      "the component has no {} port '{}'; it has [{}]", kind, name, fmt::join(known, ", ")));
}

template <typename Ports>
void require_new(const Ports& ports, std::string_view kind, std::string_view name) {
  if (ports.contains(name)) {
    throw std::logic_error(fmt::format("the component opened its {} port '{}' twice", kind, name));
  }
}

template <typename Endpoint>
void require_type(const Endpoint& endpoint,
                  std::string_view kind,
                  std::string_view name,
                  const MessageType* type) {
  const bool same = type == nullptr ? endpoint.raw()
                                    : !endpoint.raw() && endpoint.type().ros_name == type->ros_name;
  if (same) return;
  throw std::logic_error(fmt::format("{} port '{}' carries {}{}, not {}",
                                     kind,
                                     name,
                                     endpoint.raw() ? "serialised " : "",
                                     endpoint.type().ros_name,
                                     type == nullptr ? "RawMessage" : type->ros_name));
}

}  // namespace

class FakeContext::CapturingLogger final : public Logger {
 public:
  void write(LogLevel level, std::string_view text) override {
    const std::lock_guard lock(mutex_);
    entries_.push_back({level, std::string(text)});
  }
  [[nodiscard]] bool enabled(LogLevel) const override { return true; }
  [[nodiscard]] std::vector<LogEntry> entries() const {
    const std::lock_guard lock(mutex_);
    return entries_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<LogEntry> entries_;
};

FakeContext::FakeContext(std::string name)
    : name_(std::move(name)), now_ns_(kFirstNowNs), log_(std::make_unique<CapturingLogger>()) {}

FakeContext::~FakeContext() = default;

Logger& FakeContext::log() { return *log_; }

std::vector<FakeContext::LogEntry> FakeContext::log_entries() const { return log_->entries(); }

void FakeContext::set_parameter(std::string_view key, config::Value value) {
  given_.insert_or_assign(std::string(key), config::Parameter{std::move(value), {"test", 0}});
}

std::string FakeContext::topic_of(const Port& port) const {
  const auto remapped = remap_.find(port.name);
  return remapped != remap_.end() ? remapped->second : Context::topic_of(port);
}

void FakeContext::accept_parameters(config::ParameterMap effective,
                                    std::vector<config::Problem> problems) {
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  effective_ = std::move(effective);
}

std::vector<config::Problem> FakeContext::change_parameters(const config::ParameterMap& changes) {
  if (change_handler_) {
    auto problems = change_handler_(changes);
    for (const auto& [key, parameter] : changes) {
      if (problems.empty()) effective_.insert_or_assign(key, parameter);
    }
    return problems;
  }
  std::vector<config::Problem> problems;
  for (const auto& [key, parameter] : changes) {
    problems.push_back({parameter.location, key, "the component's parameters are fixed"});
  }
  return problems;
}

FakePublisher& FakeContext::output(std::string_view port) const {
  return find_port(outputs_, "output", port);
}

FakeSubscription& FakeContext::input(std::string_view port) const {
  return find_port(inputs_, "input", port);
}

std::shared_ptr<void> FakeContext::new_input(std::string_view port, const MessageType* type) {
  require_input(port, type);
  return make_unclean_message(input(port).type());
}

void FakeContext::require_input(std::string_view port, const MessageType* type) const {
  require_type(input(port), "input", port, type);
}

void FakeContext::forget_published(std::string_view port) { output(port).forget(); }

void FakeContext::send_copy(std::string_view port, const MessageType* type, const void* message) {
  auto copy = new_input(port, type);
  const auto& own_type = input(port).type();
  if (own_type.counters_valid(message)) own_type.copy(message, copy.get());
  deliver(port, own_type.counters_valid(message) ? std::move(copy) : nullptr);
}

void FakeContext::deliver(std::string_view port, std::shared_ptr<void> message) {
  auto& subscription = input(port);
  if (!message || !subscription.type().counters_valid(message.get())) {
    throw std::logic_error(
        fmt::format("input port '{}': a counter of the {} exceeds its list's "
                    "capacity; the middleware would not deliver it",
                    port,
                    subscription.type().ros_name));
  }
  subscription.push(std::move(message), now_ns_);
  deliver_waiting();
}

void FakeContext::deliver_waiting() {
  for (const auto& [port, subscription] : inputs_) subscription->deliver();
}

std::vector<std::shared_ptr<const void>> FakeContext::published_on(std::string_view port,
                                                                   const MessageType* type) const {
  require_type(output(port), "output", port, type);
  return output(port).published();
}

FakeContext::Timer* FakeContext::next_due(std::int64_t until_ns) {
  Timer* next = nullptr;
  for (auto& timer : timers_) {
    if (timer.due_ns <= until_ns && (next == nullptr || timer.due_ns < next->due_ns)) next = &timer;
  }
  return next;
}

void FakeContext::advance(std::chrono::nanoseconds duration) {
  if (duration.count() < 0) throw std::logic_error("the clock cannot be moved back");
  deliver_waiting();
  const std::int64_t until_ns = now_ns_ + duration.count();
  while (Timer* const timer = next_due(until_ns)) {
    now_ns_ = std::max(now_ns_, timer->due_ns);
    timer->due_ns += timer->period_ns;
    const auto callback = timer->callback;  // it may add timers
    callback();
  }
  now_ns_ = until_ns;
}

std::size_t FakeContext::run_posted(std::chrono::milliseconds patience) {
  deliver_waiting();
  std::deque<std::function<void()>> work;
  {
    std::unique_lock lock(posted_mutex_);
    posted_something_.wait_for(lock, patience, [this] { return !posted_.empty(); });
    work.swap(posted_);
  }
  for (const auto& callback : work) callback();
  return work.size();
}

void FakeContext::set_subscriber_count(std::string_view port, std::size_t count) {
  output(port).set_subscriber_count(count);
}

std::size_t FakeContext::outstanding_loans(std::string_view port) const {
  return output(port).outstanding();
}

std::size_t FakeContext::discarded_loans(std::string_view port) const {
  return output(port).discarded();
}

SubscriptionStats FakeContext::subscription_stats(std::string_view port) const {
  return input(port).stats();
}

Qos FakeContext::subscription_qos(std::string_view port) const { return input(port).qos(); }

void FakeContext::verify_nothing_left() const {
  std::vector<std::string> left;
  const auto report = [&left](auto count, std::string_view port, std::string_view what) {
    if (count != 0) left.push_back(fmt::format("'{}': {} {}", port, count, what));
  };
  for (const auto& [port, publisher] : outputs_) {
    report(publisher->outstanding(), port, "loans neither published nor dropped");
  }
  for (const auto& [port, subscription] : inputs_) {
    report(subscription->held(), port, "samples still held");
    report(subscription->waiting(), port, "messages not delivered");
  }
  const std::lock_guard lock(posted_mutex_);
  report(posted_.size(), "post", "callbacks not run");
  if (!left.empty()) throw std::logic_error(fmt::format("{}", fmt::join(left, "; ")));
}

void FakeContext::every(std::chrono::nanoseconds period, std::function<void()> callback) {
  if (period.count() <= 0) throw std::logic_error("a timer's period must be positive");
  timers_.push_back({now_ns_ + period.count(), period.count(), std::move(callback)});
}

void FakeContext::post(std::function<void()> callback) {
  const std::lock_guard lock(posted_mutex_);
  posted_.push_back(std::move(callback));
  posted_something_.notify_all();
}

std::shared_ptr<PublisherBackend> FakeContext::make_publisher(const Port& port,
                                                              const MessageType& type,
                                                              const PublishOptions& options) {
  require_new(outputs_, "output", port.name);
  const std::string name(port.name);
  return outputs_[name] = std::make_shared<FakePublisher>(name, type, false, options.max_loans);
}

Subscription FakeContext::make_subscription(const Port& port,
                                            const MessageType& type,
                                            Callback callback,
                                            const SubscribeOptions& options) {
  require_new(inputs_, "input", port.name);
  return inputs_[std::string(port.name)] =
             std::make_shared<FakeSubscription>(type, false, std::move(callback), options);
}

std::shared_ptr<PublisherBackend> FakeContext::make_raw_publisher(const Port& port,
                                                                  std::string_view type_name,
                                                                  const PublishOptions& options) {
  require_new(outputs_, "output", port.name);
  const std::string name(port.name);
  return outputs_[name] = std::make_shared<FakePublisher>(
             name, raw_message_type(type_name), true, options.max_loans);
}

Subscription FakeContext::make_raw_subscription(const Port& port,
                                                std::string_view type_name,
                                                Callback callback,
                                                const SubscribeOptions& options) {
  require_new(inputs_, "input", port.name);
  return inputs_[std::string(port.name)] = std::make_shared<FakeSubscription>(
             raw_message_type(type_name), true, std::move(callback), options);
}

void FakeContext::make_service(const Port& port,
                               const MessageType& request,
                               const MessageType& response,
                               ServiceHandler handler) {
  require_new(services_, "service", port.name);
  services_[std::string(port.name)] =
      std::make_unique<Service>(Service{&request, &response, std::move(handler)});
}

const Context::ServiceHandler& FakeContext::service(std::string_view port,
                                                    const MessageType* request,
                                                    const MessageType* response) const {
  const auto& service = find_port(services_, "service", port);
  if (service.request != request || service.response != response) {
    throw std::logic_error(fmt::format(
        "service port '{}' takes {}, not {}", port, service.request->ros_name, request->ros_name));
  }
  return service.handler;
}

}  // namespace camvox
