#include "camvox/bringup/container.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <future>
#include <mutex>
#include <stdexcept>

#include "camvox/dds/shared_memory.hpp"
#include "component_slot.hpp"
#include "container_services.hpp"
#include "diagnostics_publisher.hpp"

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kTickPeriod = 50ms;  // how soon failures, restarts and hangs are seen to
constexpr auto kUnloadTimeout = 1000ms;
constexpr auto kControlTimeout = 300ms;
constexpr auto kParameterTimeout = 5s;

dds::ParticipantOptions participant_options(const ContainerConfig& config) {
  const auto& transports = config.transports;
  dds::ParticipantOptions options;
  options.name = config.name;
  options.domain_id = config.domain_id;
  options.network = config.network == "subnet" ? dds::Network::kSubnet : dds::Network::kLocalhost;
  options.shared_memory =
      std::find(transports.begin(), transports.end(), "shared_memory") != transports.end();
  options.udp = std::find(transports.begin(), transports.end(), "udp") != transports.end();
  options.shared_memory_segment_bytes = static_cast<std::size_t>(config.shared_memory_segment_mb)
                                        << 20;
  options.peers = config.peers;
  return options;
}

dds::TopicSettingsMap topic_settings(const SystemConfig& config) {
  dds::TopicSettingsMap settings;
  for (const auto& [topic, entry] : config.topics) {
    settings[topic] = {entry.zero_copy == "interprocess",
                       std::chrono::milliseconds(entry.max_blocking_ms)};
  }
  return settings;
}

std::string join(const std::vector<Problem>& problems) {
  return config::ConfigError(problems).what();
}

template <typename Future>
void wait_for(const Future& work) {
  if (work.valid()) work.wait();
}

std::vector<Problem> answer_of(const std::string& component,
                               std::future<std::vector<Problem>> answer) {
  if (answer.wait_for(kParameterTimeout) != std::future_status::ready) {
    return {
        {{component, 0}, "", "the component did not answer; a callback of it is still running"}};
  }
  try {
    return answer.get();
  } catch (const std::future_error&) {
    return {{{component, 0}, "", "the component ended before it answered"}};
  }
}

}  // namespace

ContainerConfig with_ros_environment(ContainerConfig config) {
  const auto options = dds::with_ros_environment(participant_options(config));
  config.domain_id = options.domain_id;
  config.network = options.network == dds::Network::kSubnet ? "subnet" : "localhost";
  config.peers = options.peers;
  return config;
}

struct Container::Implementation {
  Implementation(SystemConfig system,
                 ProbedSystem probed_system,
                 std::shared_ptr<PluginLoader> plugins,
                 LoggerFactory loggers)
      : config(std::move(system)), probed(std::move(probed_system)) {
    environment.plugins = std::move(plugins);
    environment.make_logger = std::move(loggers);
    log = environment.make_logger(config.container.name);
  }

  void start(Container& self);
  void start_control(Container& self);
  [[nodiscard]] bool end_control(std::chrono::milliseconds timeout);
  ComponentSlot& add(const ComponentConfig& component, ProbedComponent found);
  std::vector<std::string> end_components(Clock::time_point deadline,
                                          const std::function<void()>& before_saving);
  void tick();
  std::vector<Problem> problems_of(const ComponentConfig& component, const ProbedComponent& found);
  std::vector<Problem> set_parameters(const std::string& name, const ParameterMap& changes);
  ParameterMap parameters_of(const std::string& name);
  ComponentSlot* find(std::uint64_t id);
  ComponentSlot* find(const std::string& name);
  void doing(std::string what) {
    const std::lock_guard lock(activity_mutex);
    activity = std::move(what);
  }

  SystemConfig config;
  ProbedSystem probed;
  Environment environment;
  std::shared_ptr<Logger> log;
  mutable std::mutex mutex;  // guards the slots; never held while a component's code runs
  std::vector<std::unique_ptr<ComponentSlot>> slots;
  std::uint64_t last_id = 0;
  bool running = false;
  bool all_saved = true;
  std::shared_ptr<dds::Executor> control_executor;
  std::unique_ptr<dds::ComponentContext> control;  // the container as a component of itself
  std::unique_ptr<DiagnosticsPublisher> diagnostics;
  std::unique_ptr<ContainerServices> services;
  mutable std::mutex activity_mutex;
  std::string activity;
};

void Container::Implementation::start(Container& self) {
  const auto stale = dds::remove_stale_shared_memory();
  if (!stale.empty()) {
    log->info("removed {} shared memory files that killed processes left in /dev/shm",
              stale.size());
  }
  const auto options = participant_options(config.container);
  doing("joining domain " + std::to_string(options.domain_id));
  environment.middleware = dds::make_middleware(options, topic_settings(config), *log);
  environment.middleware.all_idle = environment.executors.idle_query();
  for (std::size_t i = 0; i < config.components.size(); ++i) {
    auto& slot = add(config.components[i], probed.components.at(i));
    slot.construct();
    wait_for(slot.constructed());
  }
  start_control(self);
  for (const auto& slot : slots) slot->launch();
  running = true;
  log->info("{} components on domain {} ({})",
            slots.size(),
            options.domain_id,
            options.network == dds::Network::kSubnet ? "subnet" : "localhost");
  doing("running");
}

void Container::Implementation::start_control(Container& self) {
  control_executor = std::make_shared<dds::Executor>("control");
  control_executor->start();
  control = std::make_unique<dds::ComponentContext>(
      dds::ComponentSettings{config.container.name, {}, {}, 0},
      environment.middleware,
      control_executor,
      log,
      [log = log](const std::exception_ptr& error) { log->error("{}", describe(error)); });
  diagnostics = std::make_unique<DiagnosticsPublisher>(*control, config.container.name);
  services = std::make_unique<ContainerServices>(
      self,
      config.container.name,
      environment.middleware.participant,
      control_executor,
      [this](const auto& name, const auto& changes) { return set_parameters(name, changes); },
      [this](const auto& name) { return parameters_of(name); });
  for (const auto& slot : slots) services->add_component(slot->config().name);
  control->every(kTickPeriod, [this] { tick(); });
  const auto period = std::chrono::duration<double>(config.container.diagnostics_period_s);
  control->every(std::chrono::duration_cast<std::chrono::nanoseconds>(period), [this] {
    const std::lock_guard lock(mutex);
    std::vector<DiagnosticsPublisher::Entry> entries;
    for (const auto& slot : slots) entries.push_back({slot->config().name, slot->health()});
    diagnostics->publish(entries);
  });
  control->activate();
}

/// No new work for the control thread. False: it is still busy with some.
bool Container::Implementation::end_control(std::chrono::milliseconds timeout) {
  const bool control_ended = control == nullptr || control->deactivate(timeout);
  const bool services_ended = services == nullptr || services->end(timeout);
  return control_ended && services_ended;
}

ComponentSlot& Container::Implementation::add(const ComponentConfig& component,
                                              ProbedComponent found) {
  doing("constructing component '" + component.name + "'");
  slots.push_back(
      std::make_unique<ComponentSlot>(++last_id, component, std::move(found), environment));
  return *slots.back();
}

void Container::Implementation::tick() {
  const std::lock_guard lock(mutex);
  if (!running) return;
  for (const auto& slot : slots) slot->tick(Clock::now());
}

std::vector<Problem> Container::Implementation::set_parameters(const std::string& name,
                                                               const ParameterMap& changes) {
  std::future<std::vector<Problem>> answer;
  {
    const std::lock_guard lock(mutex);
    auto* slot = find(name);
    if (slot == nullptr) return {{{name, 0}, "", "there is no such component"}};
    answer = slot->request_change(changes);
  }
  auto problems = answer_of(name, std::move(answer));  // without the lock: it may be busy for long
  if (!problems.empty()) return problems;
  const std::lock_guard lock(mutex);
  if (auto* slot = find(name)) slot->keep_parameters(changes);
  return {};
}

ParameterMap Container::Implementation::parameters_of(const std::string& name) {
  const std::lock_guard lock(mutex);
  const auto* slot = find(name);
  return slot == nullptr ? ParameterMap{} : slot->probed().effective_parameters;
}

std::vector<std::string> Container::Implementation::end_components(
    Clock::time_point deadline, const std::function<void()>& before_saving) {
  std::vector<std::string> hung;
  for (const auto& slot : slots) slot->close();
  for (const auto& slot : slots) {
    doing("ending component '" + slot->config().name + "'");
    if (!slot->halt(deadline)) hung.push_back(slot->config().name);
  }
  if (before_saving) before_saving();
  for (const auto& slot : slots) {  // a hung one does not keep the others from saving
    if (std::find(hung.begin(), hung.end(), slot->config().name) != hung.end()) continue;
    doing("saving results of component '" + slot->config().name + "'");
    all_saved = slot->save().get() && all_saved;
  }
  return hung;
}

ComponentSlot* Container::Implementation::find(std::uint64_t id) {
  const auto found = std::find_if(
      slots.begin(), slots.end(), [id](const auto& slot) { return slot->info().id == id; });
  return found == slots.end() ? nullptr : found->get();
}

ComponentSlot* Container::Implementation::find(const std::string& name) {
  const auto found = std::find_if(slots.begin(), slots.end(), [&name](const auto& slot) {
    return slot->config().name == name;
  });
  return found == slots.end() ? nullptr : found->get();
}

std::vector<Problem> Container::Implementation::problems_of(const ComponentConfig& component,
                                                            const ProbedComponent& found) {
  std::vector<Problem> problems = found.problems;
  if (const auto problem = component_name_problem(component.name); !problem.empty()) {
    problems.push_back({component.location, "name", problem});
  }
  SystemConfig together = config;
  together.components.clear();
  together.topic_locations.clear();
  std::vector<ProbedComponent> all;
  for (const auto& slot : slots) {
    if (slot->config().name == component.name) {
      problems.push_back(
          {component.location, "name", "there is a component '" + component.name + "' already"});
    }
    together.components.push_back(slot->config());
    all.push_back(slot->probed());
  }
  together.components.push_back(component);
  all.push_back(found);
  // An input without a writer is no error here: its writer may be the next to be loaded.
  for (const auto& problem : check_wiring(together, all, MissingWriters::kAllowed)) {
    problems.push_back(problem);
  }
  return problems;
}

Container::Container(SystemConfig config,
                     ProbedSystem probed,
                     std::shared_ptr<PluginLoader> plugins,
                     LoggerFactory loggers)
    : implementation_(std::make_unique<Implementation>(
          std::move(config), std::move(probed), std::move(plugins), std::move(loggers))) {}

Container::~Container() { stop(); }

void Container::start() {
  const std::lock_guard lock(implementation_->mutex);
  implementation_->start(*this);
}

void Container::on_exit_request(std::function<void()> callback) {
  implementation_->environment.exit_request = std::move(callback);
}

std::vector<std::string> Container::stop(std::chrono::milliseconds timeout,
                                         const std::function<void()>& before_saving) {
  auto& self = *implementation_;
  const auto deadline = Clock::now() + timeout;
  std::unique_lock lock(self.mutex);
  self.running = false;
  // Whatever the control thread is at: the components' results come first.
  (void)self.end_control(0ms);
  const auto hung = self.end_components(deadline, before_saving);
  if (!hung.empty()) return hung;  // their threads live on: nothing more can be taken down
  lock.unlock();                   // which the control thread may need to come to an end
  self.doing("ending the container's own services");
  if (!self.end_control(kControlTimeout)) return {self.config.container.name};
  lock.lock();
  self.doing("leaving the domain");
  self.slots.clear();
  self.services.reset();
  self.diagnostics.reset();
  self.control.reset();
  self.control_executor.reset();
  self.environment.executors.clear();
  self.environment.middleware = {};
  return {};
}

ComponentInfo Container::load(const ComponentConfig& given) {
  auto& self = *implementation_;
  auto component = given;
  const auto factory = self.environment.plugins->factory(component.plugin);
  auto found = probe_component(component, *factory);
  if (give_shared_parameters(self.config.shared_parameters, found, component)) {
    found = probe_component(component, *factory);
  }
  std::unique_lock lock(self.mutex);
  if (!self.running) throw std::runtime_error("the container does not run");
  if (const auto problems = self.problems_of(component, found); !problems.empty()) {
    throw std::runtime_error(join(problems));
  }
  auto& added = self.add(component, found);
  const auto id = added.info().id;
  added.construct();
  const auto constructed = added.constructed();
  lock.unlock();
  wait_for(constructed);
  lock.lock();
  auto* slot = self.find(id);
  if (!self.running || slot == nullptr) throw std::runtime_error("ended while it was loaded");
  slot->launch();
  self.services->add_component(component.name);
  self.doing("running");
  return slot->info();
}

void Container::unload(std::uint64_t id) {
  auto& self = *implementation_;
  std::unique_lock lock(self.mutex);
  auto* slot = self.find(id);
  if (slot == nullptr)
    throw std::runtime_error(fmt::format("No node found with unique_id: {}", id));
  if (!slot->halt(Clock::now() + kUnloadTimeout)) {
    throw std::runtime_error("component '" + slot->config().name +
                             "' hangs and cannot be unloaded");
  }
  const auto saved = slot->save();
  lock.unlock();
  saved.wait();
  lock.lock();
  slot = self.find(id);
  if (!self.running || slot == nullptr) return;  // stop() takes it down
  self.services->remove_component(slot->config().name);
  std::erase_if(self.slots, [slot](const auto& candidate) { return candidate.get() == slot; });
}

std::vector<ComponentInfo> Container::components() const {
  const std::lock_guard lock(implementation_->mutex);
  std::vector<ComponentInfo> all;
  for (const auto& slot : implementation_->slots) all.push_back(slot->info());
  return all;
}

bool Container::all_saved() const { return implementation_->all_saved; }

std::string Container::current_activity() const {
  const std::lock_guard lock(implementation_->activity_mutex);
  return implementation_->activity;
}

}  // namespace camvox::bringup
