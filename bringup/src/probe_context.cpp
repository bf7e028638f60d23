#include "probe_context.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace camvox::bringup {
namespace {

class SilentLogger final : public Logger {
 public:
  void write(LogLevel, std::string_view) override {}
  [[nodiscard]] bool enabled(LogLevel) const override { return false; }
};

/// Loans live on the heap and go nowhere.
class HeapPublisher final : public PublisherBackend {
 public:
  HeapPublisher(void* (*create)(), void (*destroy)(void*)) : create_(create), destroy_(destroy) {}
  void* loan() override { return create_(); }
  void publish(void* message) override { destroy_(message); }
  void discard(void* message) noexcept override { destroy_(message); }
  [[nodiscard]] std::size_t subscriber_count() const override { return 0; }

 private:
  void* (*create_)();
  void (*destroy_)(void*);
};

bool is_internal(std::string_view type_name) {
  const auto* type = interfaces::find_message_type(type_name);
  return type != nullptr && type->plain;
}

class SilentSubscription final : public SubscriptionBackend {
 public:
  [[nodiscard]] SubscriptionStats stats() const override { return {}; }
  [[nodiscard]] std::size_t publisher_count() const override { return 0; }
};

/// The parameter that a constructor means, which may name it as the block does that it checked, and
/// where it was given.
std::pair<std::string, Location> as_given(const std::string& key, const ComponentConfig& config) {
  for (const auto& [full_key, parameter] : config.parameters) {
    if (full_key == key || full_key.ends_with("." + key)) return {full_key, parameter.location};
  }
  return {key, config.plugin_location};
}

}  // namespace

ProbeContext::ProbeContext(const ComponentConfig& config) : config_(config) {
  result_.name = config.name;
}

Logger& ProbeContext::log() {
  static SilentLogger logger;
  return logger;
}

std::string ProbeContext::topic_of(const Port& port) const {
  const auto remapped = config_.remap.find(port.name);
  return remapped != config_.remap.end() ? remapped->second.topic : std::string(port.default_topic);
}

void ProbeContext::every(std::chrono::nanoseconds period, std::function<void()>) {
  if (period.count() <= 0) throw std::invalid_argument("Context::every needs a period above zero");
}

void ProbeContext::post(std::function<void()>) {}

void ProbeContext::report(const Location& location, const std::string& key, std::string message) {
  result_.problems.push_back({location, config_.name + "." + key, std::move(message)});
}

void ProbeContext::accept_parameters(ParameterMap effective, std::vector<Problem> problems) {
  has_parameters_ = true;
  for (auto& [key, parameter] : effective) {
    const auto given = config_.parameters.find(key);
    if (given != config_.parameters.end()) parameter.location = given->second.location;
    result_.effective_parameters.insert_or_assign(key, parameter);
  }
  for (auto& problem : problems) {
    report(problem.location, "parameters." + problem.key, std::move(problem.message));
  }
}

void ProbeContext::record(
    const Port& port, std::string_view type_name, bool internal, bool is_output, bool required) {
  const auto topic = topic_of(port);
  if (const auto problem = topics::name_problem(topic);
      !problem.empty() && !config_.remap.contains(port.name)) {
    report(config_.location, "remap." + std::string(port.name), problem);
  }
  result_.ports.push_back(
      {std::string(port.name), topic, std::string(type_name), is_output, internal, required});
}

std::shared_ptr<PublisherBackend> ProbeContext::make_publisher(const Port& port,
                                                               const MessageType& type,
                                                               const PublishOptions& options) {
  record(
      port, options.type_name.empty() ? type.ros_name : options.type_name, type.plain, true, false);
  return std::make_shared<HeapPublisher>(type.create, type.destroy);
}

Subscription ProbeContext::make_subscription(const Port& port,
                                             const MessageType& type,
                                             Callback,
                                             const SubscribeOptions& options) {
  record(port,
         options.type_name.empty() ? type.ros_name : options.type_name,
         type.plain,
         false,
         options.required);
  return std::make_shared<SilentSubscription>();
}

std::shared_ptr<PublisherBackend> ProbeContext::make_raw_publisher(const Port& port,
                                                                   std::string_view type_name,
                                                                   const PublishOptions&) {
  record(port, type_name, is_internal(type_name), true, false);
  return std::make_shared<HeapPublisher>([]() -> void* { return new RawMessage(); },
                                         [](void* raw) { delete static_cast<RawMessage*>(raw); });
}

Subscription ProbeContext::make_raw_subscription(const Port& port,
                                                 std::string_view type_name,
                                                 Callback,
                                                 const SubscribeOptions& options) {
  record(port, type_name, is_internal(type_name), false, options.required);
  return std::make_shared<SilentSubscription>();
}

void ProbeContext::make_service(const Port& port,
                                const MessageType& request,
                                const MessageType&,
                                ServiceHandler) {
  static constexpr std::string_view kEnd = "_Request";
  std::string_view type = request.ros_name;
  if (type.ends_with(kEnd)) type.remove_suffix(kEnd.size());
  record(port, type, false, false, false);
}

ProbedComponent ProbeContext::take_result() { return std::move(result_); }

void ProbeContext::check_complete() {
  std::vector<std::string> ports;
  for (const auto& port : result_.ports) ports.push_back(port.name);
  for (const auto& [port, target] : config_.remap) {
    if (std::find(ports.begin(), ports.end(), port) != ports.end()) continue;
    const auto nearest = config::nearest_name(port, ports);
    report(target.location,
           "remap." + port,
           nearest.empty() ? fmt::format("unknown port (there are {})", fmt::join(ports, ", "))
                           : fmt::format("unknown port (did you mean '{}'?)", nearest));
  }
  result_.constructed = true;
  if (!has_parameters_) {
    for (const auto& [key, parameter] : config_.parameters) {
      report(parameter.location, "parameters." + key, "the component takes no parameters");
    }
  }
}

ProbedComponent probe_component(const ComponentConfig& config, ComponentFactory& factory) {
  ProbeContext context(config);
  try {
    (void)factory.create(context);
    context.check_complete();  // after an exception, what it asked for is not known in full
  } catch (const config::ConfigError& error) {
    for (const auto& problem : error.problems()) {
      const auto [key, location] = as_given(problem.key, config);
      context.report(location, "parameters." + key, problem.message);
    }
  } catch (...) {
    context.report(config.plugin_location,
                   "plugin",
                   "constructor threw an exception: " + describe(std::current_exception()));
  }
  return context.take_result();
}

}  // namespace camvox::bringup
