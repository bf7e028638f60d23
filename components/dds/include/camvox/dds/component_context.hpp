#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "camvox/component/context.hpp"
#include "camvox/dds/executor.hpp"
#include "camvox/dds/participant.hpp"
#include "camvox/dds/service.hpp"

namespace camvox::dds {

/// How one topic crosses this container's border; from the config's `topics` section.
struct TopicSettings {
  bool interprocess_zero_copy = false;  ///< Share memory with other processes of this machine.
  std::chrono::milliseconds max_blocking{50};  ///< Longest time a publish may wait for readers.
};
using TopicSettingsMap = std::map<std::string, TopicSettings, std::less<>>;

class Gateway;

/// What all components of one container share.
struct Middleware {
  std::shared_ptr<Participant> participant;
  std::shared_ptr<Gateway> gateway;  ///< Carries internal topics to and from other processes.
  TopicSettingsMap topics;
  std::function<bool()> all_idle;  ///< What Context::all_idle tells, from any thread; or none.
};

/// Creates what the components of a container share.
[[nodiscard]] Middleware make_middleware(const ParticipantOptions& options,
                                         TopicSettingsMap topics,
                                         Logger& log);

/// A component's place in a container, from its config entry.
struct ComponentSettings {
  std::string name;
  config::ParameterMap parameters;
  std::map<std::string, std::string, std::less<>> remap;  ///< Port name -> topic name.
  std::uint64_t earlier_runs = 0;                         ///< See Context.
  /// See Context.
  std::shared_ptr<std::any> restart_memory = std::make_shared<std::any>();
};

/// A ROS topic, and who publishes and reads it.
struct TopicEndpoints {
  std::string name;       ///< "/tf"
  std::string type_name;  ///< "tf2_msgs/msg/TFMessage"
  std::vector<DiscoveredEndpoint> publishers;
  std::vector<DiscoveredEndpoint> subscribers;
};

/// The ROS-visible topics among the endpoints, sorted by name.
[[nodiscard]] std::vector<TopicEndpoints> topics_of(
    const std::vector<DiscoveredEndpoint>& endpoints);
[[nodiscard]] TopicDescription describe(const TopicEndpoints& topic);

/// Counters of one subscription of a component, for diagnostics and `topic info`.
struct PortStats {
  std::string topic;
  SubscriptionStats stats;
};

/// Messages of a component that others did not get.
struct UnsentCount {
  std::string topic;
  std::uint64_t messages =
      0;  ///< No room, readers too slow, or lost on the way to other processes.
};

/// Context over Fast DDS. Endpoints are made while the component is constructed, but nothing is
/// delivered before `activate`.
class ComponentContext final : public Context {
 public:
  /// `on_error` gets each exception that leaves a callback, on the executor's thread.
  ComponentContext(ComponentSettings settings,
                   Middleware middleware,
                   std::shared_ptr<Executor> executor,
                   std::shared_ptr<Logger> log,
                   std::function<void(std::exception_ptr)> on_error);
  ~ComponentContext() override;

  /// Starts delivery: subscriptions, timers, posted work.
  void activate();
  /// Ends delivery. False: a callback did not return in time; the component must then be kept.
  bool deactivate(std::chrono::milliseconds timeout);

  [[nodiscard]] const std::shared_ptr<Tenant>& tenant() const { return tenant_; }
  [[nodiscard]] config::ParameterMap effective_parameters() const;
  [[nodiscard]] bool parameters_can_change() const { return change_handler_ != nullptr; }
  /// Checks and applies changed parameters on the component's thread. The answer is what is wrong;
  /// then nothing was changed. A component that ends before it answers breaks the promise.
  [[nodiscard]] std::future<std::vector<config::Problem>> request_change(
      const config::ParameterMap& changes);
  [[nodiscard]] std::vector<PortStats> subscription_stats() const;
  /// Of internal topics.
  [[nodiscard]] std::vector<UnsentCount> unsent() const;

  [[nodiscard]] const std::string& name() const override { return settings_.name; }
  [[nodiscard]] std::uint64_t earlier_runs() const override { return settings_.earlier_runs; }
  [[nodiscard]] std::any* restart_memory() override { return settings_.restart_memory.get(); }
  [[nodiscard]] Logger& log() override { return *log_; }
  [[nodiscard]] Diagnostics& diagnostics() override { return diagnostics_; }
  [[nodiscard]] std::int64_t now_ns() const override;
  [[nodiscard]] std::string topic_of(const Port& port) const override;
  [[nodiscard]] std::vector<TopicDescription> topics() const override;
  void every(std::chrono::nanoseconds period, std::function<void()> callback) override;
  void post(std::function<void()> callback) override;
  void request_exit() override {
    if (exit_request_) exit_request_();
  }
  [[nodiscard]] bool all_idle() const override {
    return !middleware_.all_idle || middleware_.all_idle();
  }
  /// What request_exit does; before the component is made.
  void on_exit_request(std::function<void()> callback) { exit_request_ = std::move(callback); }

 protected:
  [[nodiscard]] const config::ParameterMap& given_parameters() const override {
    return settings_.parameters;
  }
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
  [[nodiscard]] TopicSettings settings_of(const std::string& topic) const;
  void when_active(std::function<void()> action);
  void keep(const std::string& topic, Subscription subscription);
  Subscription make_ros_subscription(const Port& port,
                                     MessageType type,
                                     Callback callback,
                                     const SubscribeOptions& options);

  ComponentSettings settings_;
  Middleware middleware_;
  std::shared_ptr<Executor> executor_;
  std::shared_ptr<Logger> log_;
  std::shared_ptr<Tenant> tenant_;
  Diagnostics diagnostics_;
  mutable std::mutex effective_mutex_;  // changed on the component's thread, read on any
  config::ParameterMap effective_;
  ChangeHandler change_handler_;
  std::function<void()> exit_request_;
  bool active_ = false;
  std::vector<std::function<void()>> pending_;
  mutable std::mutex endpoints_mutex_;  // made on the component's thread, read on any
  std::vector<std::pair<std::string, Subscription>> subscriptions_;
  std::map<std::string, std::function<std::uint64_t()>> unsent_;  // by topic
  std::vector<std::unique_ptr<ServiceServer>> services_;
  std::vector<std::shared_ptr<void>> border_handles_;  // what the gateway carries for us
};

}  // namespace camvox::dds
