#include "camvox/dds/component_context.hpp"

#include <algorithm>
#include <chrono>

#include "camvox/component/raw_message.hpp"
#include "gateway.hpp"
#include "plain_publisher.hpp"
#include "plain_subscription.hpp"
#include "ros_endpoints.hpp"
#include "topic_types.hpp"

namespace camvox::dds {
namespace {

constexpr std::chrono::milliseconds kTearDownTimeout{1000};

/// Gives the middleware's threads a logger that lives as long as they do.
class ForwardingLogger final : public Logger {
 public:
  explicit ForwardingLogger(Logger& target) : target_(target) {}
  void write(LogLevel level, std::string_view text) override { target_.write(level, text); }
  [[nodiscard]] bool enabled(LogLevel level) const override { return target_.enabled(level); }

 private:
  Logger& target_;
};

}  // namespace

Middleware make_middleware(const ParticipantOptions& options,
                           TopicSettingsMap topics,
                           Logger& log) {
  Middleware middleware;
  middleware.participant = Participant::create(options, log);
  middleware.gateway =
      std::make_shared<Gateway>(middleware.participant, std::make_shared<ForwardingLogger>(log));
  middleware.topics = std::move(topics);
  return middleware;
}

std::vector<TopicEndpoints> topics_of(const std::vector<DiscoveredEndpoint>& endpoints) {
  static constexpr std::string_view kRosPrefix = "rt/";
  std::map<std::string, TopicEndpoints> topics;
  for (const auto& endpoint : endpoints) {
    if (!endpoint.topic_name.starts_with(kRosPrefix)) continue;
    const std::string name = endpoint.topic_name.substr(kRosPrefix.size() - 1);
    auto& topic = topics[name];
    topic.name = name;
    // What is sent counts: a reader of another type gets nothing of it.
    if (endpoint.is_writer || topic.publishers.empty()) {
      topic.type_name = interfaces::to_ros_type_name(endpoint.type_name);
    }
    (endpoint.is_writer ? topic.publishers : topic.subscribers).push_back(endpoint);
  }
  std::vector<TopicEndpoints> sorted;
  for (auto& [name, topic] : topics) sorted.push_back(std::move(topic));
  return sorted;
}

TopicDescription describe(const TopicEndpoints& topic) {
  const auto all_offer = [&topic](bool DiscoveredEndpoint::*policy) {
    return std::all_of(topic.publishers.begin(),
                       topic.publishers.end(),
                       [policy](const auto& publisher) { return publisher.*policy; });
  };
  TopicDescription description;
  description.name = topic.name;
  description.type_name = topic.type_name;
  description.publishers = topic.publishers.size();
  description.subscribers = topic.subscribers.size();
  description.offered.reliable = all_offer(&DiscoveredEndpoint::reliable);
  description.offered.latched =
      !topic.publishers.empty() && all_offer(&DiscoveredEndpoint::latched);
  return description;
}

ComponentContext::ComponentContext(ComponentSettings settings,
                                   Middleware middleware,
                                   std::shared_ptr<Executor> executor,
                                   std::shared_ptr<Logger> log,
                                   std::function<void(std::exception_ptr)> on_error)
    : settings_(std::move(settings)),
      middleware_(std::move(middleware)),
      executor_(std::move(executor)),
      log_(std::move(log)),
      tenant_(std::make_shared<Tenant>(settings_.name, std::move(on_error))) {}

ComponentContext::~ComponentContext() { deactivate(kTearDownTimeout); }

void ComponentContext::activate() {
  active_ = true;
  for (const auto& action : std::exchange(pending_, {})) action();
}

bool ComponentContext::deactivate(std::chrono::milliseconds timeout) {
  if (!executor_->remove(tenant_, timeout)) return false;
  services_.clear();  // their calls run as the component's own, so that none of them does any more
  return true;
}

void ComponentContext::when_active(std::function<void()> action) {
  if (active_) {
    action();
  } else {
    pending_.push_back(std::move(action));
  }
}

std::string ComponentContext::topic_of(const Port& port) const {
  const auto remapped = settings_.remap.find(port.name);
  return remapped != settings_.remap.end() ? remapped->second : std::string(port.default_topic);
}

TopicSettings ComponentContext::settings_of(const std::string& topic) const {
  const auto found = middleware_.topics.find(topic);
  return found != middleware_.topics.end() ? found->second : TopicSettings{};
}

std::int64_t ComponentContext::now_ns() const {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::vector<TopicDescription> ComponentContext::topics() const {
  auto endpoints = middleware_.participant->own_endpoints();
  for (auto& endpoint : middleware_.participant->discovered_endpoints()) {
    endpoints.push_back(std::move(endpoint));
  }
  std::vector<TopicDescription> described;
  for (const auto& topic : topics_of(endpoints)) described.push_back(describe(topic));
  return described;
}

void ComponentContext::every(std::chrono::nanoseconds period, std::function<void()> callback) {
  if (period <= std::chrono::nanoseconds::zero()) {
    throw std::logic_error(name() + ": the period of a timer must be positive");
  }
  when_active([this, period, callback = std::move(callback)] {
    executor_->every(tenant_, period, callback);
  });
}

void ComponentContext::post(std::function<void()> callback) {
  executor_->post(tenant_, std::move(callback));
}

void ComponentContext::accept_parameters(config::ParameterMap effective,
                                         std::vector<config::Problem> problems) {
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  const std::lock_guard lock(effective_mutex_);
  effective_ = std::move(effective);
}

config::ParameterMap ComponentContext::effective_parameters() const {
  const std::lock_guard lock(effective_mutex_);
  return effective_;
}

std::future<std::vector<config::Problem>> ComponentContext::request_change(
    const config::ParameterMap& changes) {
  auto done = std::make_shared<std::promise<std::vector<config::Problem>>>();
  auto answer = done->get_future();
  if (!change_handler_) {
    done->set_value(
        {{{name(), 0},
          changes.empty() ? "" : changes.begin()->first,
          "parameters of this component are fixed after start; change the config and restart"}});
    return answer;
  }
  executor_->post(tenant_, [this, done, changes] {
    auto found = change_handler_(changes);
    {
      const std::lock_guard lock(effective_mutex_);
      for (const auto& [key, parameter] : changes) {
        if (found.empty()) effective_[key] = parameter;
      }
    }
    done->set_value(std::move(found));
  });
  return answer;
}

void ComponentContext::keep(const std::string& topic, Subscription subscription) {
  const std::lock_guard lock(endpoints_mutex_);
  subscriptions_.emplace_back(topic, std::move(subscription));
}

std::vector<PortStats> ComponentContext::subscription_stats() const {
  const std::lock_guard lock(endpoints_mutex_);
  std::vector<PortStats> all;
  for (const auto& [topic, subscription] : subscriptions_) {
    all.push_back({topic, subscription->stats()});
  }
  return all;
}

std::vector<UnsentCount> ComponentContext::unsent() const {
  const std::lock_guard lock(endpoints_mutex_);
  std::vector<UnsentCount> all;
  for (const auto& [topic, count] : unsent_) all.push_back({topic, count()});
  return all;
}

std::shared_ptr<PublisherBackend> ComponentContext::make_publisher(const Port& port,
                                                                   const MessageType& type,
                                                                   const PublishOptions& options) {
  const std::string topic = topic_of(port);
  if (!type.plain) {
    return std::make_shared<RosPublisher>(middleware_.participant, topic, type, options);
  }
  const TopicSettings settings = settings_of(topic);
  if (settings.interprocess_zero_copy && !middleware_.gateway->may_produce(topic)) {
    throw std::runtime_error("topic " + topic +
                             " is read here from another process' shared memory; a container "
                             "cannot produce such a topic as well");
  }
  border_handles_.push_back(middleware_.gateway->add_producer(topic, type, options.qos));
  auto publisher =
      std::make_shared<PlainPublisher>(middleware_.participant, topic, type, options, settings);
  const std::lock_guard lock(endpoints_mutex_);
  unsent_[topic] = [unsent = publisher->unsent_count(),
                    exported = middleware_.gateway->export_stats(topic)] {
    return *unsent + exported->lost;
  };
  return publisher;
}

Subscription ComponentContext::make_subscription(const Port& port,
                                                 const MessageType& type,
                                                 Callback callback,
                                                 const SubscribeOptions& options) {
  if (!type.plain) return make_ros_subscription(port, type, std::move(callback), options);
  const std::string topic = topic_of(port);
  auto subscription =
      std::make_shared<PlainSubscription>(middleware_.participant, topic, type, options);
  const bool shared = settings_of(topic).interprocess_zero_copy;
  subscription->also_count(middleware_.gateway->border_stats(topic));
  keep(topic, subscription);
  // Only once all components are wired is it known whether the topic is produced here.
  when_active([this, subscription, topic, &type, shared, options, callback = std::move(callback)] {
    auto& gateway = *middleware_.gateway;
    if (shared && !gateway.is_produced(topic)) {
      border_handles_.push_back(gateway.add_shared_consumer(topic, type, options.qos));
      subscription->add_shared(middleware_.participant, topic, options);
    } else {
      border_handles_.push_back(gateway.add_consumer(topic, type, options.qos));
    }
    subscription->attach(*executor_, tenant_, callback);
  });
  return subscription;
}

Subscription ComponentContext::make_ros_subscription(const Port& port,
                                                     MessageType type,
                                                     Callback callback,
                                                     const SubscribeOptions& options) {
  const std::string topic = topic_of(port);
  auto subscription =
      std::make_shared<RosSubscription>(middleware_.participant, topic, std::move(type), options);
  if (middleware_.gateway) subscription->also_count(middleware_.gateway->export_stats(topic));
  keep(topic, subscription);
  when_active([this, subscription, callback = std::move(callback)] {
    subscription->attach(*executor_, tenant_, callback);
  });
  return subscription;
}

std::shared_ptr<PublisherBackend> ComponentContext::make_raw_publisher(
    const Port& port, std::string_view type_name, const PublishOptions& options) {
  return std::make_shared<RosPublisher>(
      middleware_.participant, topic_of(port), raw_message_type(type_name), options);
}

Subscription ComponentContext::make_raw_subscription(const Port& port,
                                                     std::string_view type_name,
                                                     Callback callback,
                                                     const SubscribeOptions& options) {
  return make_ros_subscription(port, raw_message_type(type_name), std::move(callback), options);
}

void ComponentContext::make_service(const Port& port,
                                    const MessageType& request,
                                    const MessageType& response,
                                    ServiceHandler handler) {
  when_active([this, name = topic_of(port), &request, &response, handler = std::move(handler)] {
    services_.push_back(std::make_unique<ServiceServer>(
        middleware_.participant,
        *executor_,
        tenant_,
        name,
        request,
        response,
        [tenant = tenant_, handler](const void* question, void* answer) {
          tenant->invoke([&] { handler(question, answer); });
        }));
  });
}

}  // namespace camvox::dds
