#pragma once

#include <algorithm>
#include <any>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "camvox/component/diagnostics.hpp"
#include "camvox/component/logger.hpp"
#include "camvox/component/publisher.hpp"
#include "camvox/component/sample.hpp"
#include "camvox/config/parameters.hpp"
#include "camvox/interfaces/message_type.hpp"
#include "camvox/interfaces/qos.hpp"
#include "camvox/interfaces/topics.hpp"

namespace camvox {

using interfaces::MessageType;
using interfaces::Qos;
namespace qos = interfaces::qos;
namespace topics = interfaces::topics;

/// One input, output or service of a component: its name in the config's `remap`, and the topic it
/// is connected to unless remapped.
struct Port {
  std::string_view name;
  std::string_view default_topic;
};

struct PublishOptions {
  Qos qos = qos::kDefault;
  int max_loans = 2;           ///< Loans that the component may hold at one time.
  std::string type_name = {};  ///< Another ROS name for the same message, e.g. of an old driver.
};

struct SubscribeOptions {
  Qos qos = qos::kDefault;
  int max_held = 2;      ///< Samples that the component may keep after its callback returned.
  bool required = true;  ///< An internal topic that nothing publishes is then an error.
  std::string type_name = {};
};

/// Counters of one subscription.
struct SubscriptionStats {
  std::uint64_t received = 0;
  std::uint64_t lost = 0;      ///< Sent but never seen here: overwritten while waiting, or dropped.
  std::uint64_t rejected = 0;  ///< Malformed, or over capacity.
  std::uint64_t starved = 0;   ///< Times that delivery waited because too many samples were held.
};

/// What a middleware keeps for a subscription; ends delivery when destroyed.
class SubscriptionBackend {
 public:
  SubscriptionBackend() = default;
  SubscriptionBackend(const SubscriptionBackend&) = delete;
  SubscriptionBackend& operator=(const SubscriptionBackend&) = delete;
  virtual ~SubscriptionBackend() = default;
  [[nodiscard]] virtual SubscriptionStats stats() const = 0;
  [[nodiscard]] virtual std::size_t publisher_count() const = 0;
};

/// Handle of a subscription. It lives as long as the component, handle or not.
using Subscription = std::shared_ptr<const SubscriptionBackend>;

/// A message as bytes, for components that work on any type (record, replay).
struct RawMessage {
  std::vector<std::uint8_t> cdr;  ///< With the four-byte encapsulation.
};

/// A topic on the wire, as discovery sees it: ROS types, and internal topics as ROS 2 sees them.
struct TopicDescription {
  std::string name;       ///< ROS name, "/livox/lidar".
  std::string type_name;  ///< ROS name, "sensor_msgs/msg/PointCloud2".
  Qos offered;            ///< What all of its publishers offer, so that a reader gets from each.
  std::size_t publishers = 0;
  std::size_t subscribers = 0;
};

/// Everything that a component sees of the world outside. The container implements it over DDS,
/// unit tests with camvox::FakeContext.
class Context {
 public:
  using Callback = std::function<void(std::shared_ptr<const void>, const MessageInfo&)>;
  using ServiceHandler = std::function<void(const void* request, void* response)>;

  Context() = default;
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  virtual ~Context() = default;

  /// The component's name in the config.
  [[nodiscard]] virtual const std::string& name() const = 0;
  /// How many components of this name the container has had before: 0 at first, then one more with
  /// each restart or load. For numbers that others compare and that must therefore not begin anew.
  [[nodiscard]] virtual std::uint64_t earlier_runs() const { return 0; }
  /// What a component leaves to the one that takes its place after an error (on_error: restart);
  /// empty at first. For what was found while running and no config knows. Of the component's
  /// thread; null where nobody keeps it.
  [[nodiscard]] virtual std::any* restart_memory() { return nullptr; }
  [[nodiscard]] virtual Logger& log() = 0;
  [[nodiscard]] virtual Diagnostics& diagnostics() = 0;
  /// Wall clock, or the time of /clock when `use_sim_time` is set; ns since the epoch.
  [[nodiscard]] virtual std::int64_t now_ns() const = 0;

  /// The component's config, checked. Throws config::ConfigError with all problems.
  template <typename Config>
  [[nodiscard]] Config parameters() {
    Config config;
    auto problems = config::load(given_parameters(), config);
    accept_parameters(config::dump(config), std::move(problems));
    return config;
  }

  /// Lets parameters be set while running: `callback` gets each new, checked config on the
  /// component's thread. Without this call every parameter is fixed after start; with a list of
  /// `changeable` keys, all others are.
  template <typename Config>
  void on_parameter_change(Config current,
                           std::function<void(const Config&)> callback,
                           const std::vector<std::string>& changeable = {}) {
    accept_changes([current, callback, changeable](const config::ParameterMap& changes) mutable {
      Config next = current;
      auto problems = config::load(changes, next);
      for (const auto& [key, parameter] : changes) {
        if (changeable.empty() || !problems.empty()) break;
        if (std::find(changeable.begin(), changeable.end(), key) != changeable.end()) continue;
        problems.push_back({parameter.location, key, "is fixed after start"});
      }
      if (problems.empty()) {
        current = next;
        callback(current);
      }
      return problems;
    });
  }

  template <typename T>
  [[nodiscard]] Publisher<T> advertise(const Port& port, const PublishOptions& options = {}) {
    return Publisher<T>(make_publisher(port, interfaces::message_type<T>(), options));
  }

  /// Calls back with every message, on the component's thread.
  template <typename T>
  Subscription subscribe(const Port& port,
                         std::function<void(const Sample<T>&)> callback,
                         const SubscribeOptions& options = {}) {
    return make_subscription(
        port,
        interfaces::message_type<T>(),
        [callback](std::shared_ptr<const void> message, const MessageInfo& info) {
          callback(Sample<T>(std::static_pointer_cast<const T>(std::move(message)), info));
        },
        options);
  }

  /// Publisher and subscription of serialised messages of any type ("pkg/msg/Name").
  [[nodiscard]] Publisher<RawMessage> advertise_raw(const Port& port,
                                                    std::string_view type_name,
                                                    const PublishOptions& options = {}) {
    return Publisher<RawMessage>(make_raw_publisher(port, type_name, options));
  }
  Subscription subscribe_raw(const Port& port,
                             std::string_view type_name,
                             std::function<void(const Sample<RawMessage>&)> callback,
                             const SubscribeOptions& options = {}) {
    return make_raw_subscription(
        port,
        type_name,
        [callback](std::shared_ptr<const void> message, const MessageInfo& info) {
          callback(Sample<RawMessage>(
              std::static_pointer_cast<const RawMessage>(std::move(message)), info));
        },
        options);
  }

  /// Answers the calls of a ROS 2 service on the component's thread. When the handler throws, the
  /// caller gets the response as it is by then.
  template <typename Request, typename Response>
  void serve(const Port& port, std::function<void(const Request&, Response&)> handler) {
    make_service(port,
                 interfaces::message_type<Request>(),
                 interfaces::message_type<Response>(),
                 [handler = std::move(handler)](const void* request, void* response) {
                   handler(*static_cast<const Request*>(request),
                           *static_cast<Response*>(response));
                 });
  }

  /// What the port is connected to: its default topic, or the one of the config's `remap`.
  [[nodiscard]] virtual std::string topic_of(const Port& port) const {
    return std::string(port.default_topic);
  }

  /// All topics that this process or another one publishes or reads at the moment, by name.
  [[nodiscard]] virtual std::vector<TopicDescription> topics() const { return {}; }

  /// Calls back periodically on the component's thread, until the component ends. A call that is
  /// late by more than a period is skipped, not made up for.
  virtual void every(std::chrono::nanoseconds period, std::function<void()> callback) = 0;

  /// Runs something once on the component's thread; safe to call from any thread.
  virtual void post(std::function<void()> callback) = 0;

  /// Asks the container to end as after Ctrl-C, because the work is done (a recording has ended).
  virtual void request_exit() {}

  /// False while a component of this container has yet to see to a message or to posted work, the
  /// callback that asks not counted. Timers, and threads of the components' own, do not count.
  [[nodiscard]] virtual bool all_idle() const { return true; }

 protected:
  using ChangeHandler =
      std::function<std::vector<config::Problem>(const config::ParameterMap& changes)>;

  [[nodiscard]] virtual const config::ParameterMap& given_parameters() const = 0;
  /// Gets the effective parameters and what is wrong with the given ones.
  virtual void accept_parameters(config::ParameterMap effective,
                                 std::vector<config::Problem> problems) = 0;
  virtual void accept_changes(ChangeHandler handler) = 0;
  virtual std::shared_ptr<PublisherBackend> make_publisher(const Port& port,
                                                           const MessageType& type,
                                                           const PublishOptions& options) = 0;
  virtual Subscription make_subscription(const Port& port,
                                         const MessageType& type,
                                         Callback callback,
                                         const SubscribeOptions& options) = 0;
  virtual std::shared_ptr<PublisherBackend> make_raw_publisher(const Port& port,
                                                               std::string_view type_name,
                                                               const PublishOptions& options) = 0;
  virtual Subscription make_raw_subscription(const Port& port,
                                             std::string_view type_name,
                                             Callback callback,
                                             const SubscribeOptions& options) = 0;
  virtual void make_service(const Port& port,
                            const MessageType& request,
                            const MessageType& response,
                            ServiceHandler handler) = 0;
};

}  // namespace camvox
