#include "camvox/bringup/container.hpp"

#include <fmt/format.h>

#include <algorithm>
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
  ComponentSlot& add(const ComponentConfig& component, ProbedComponent found);
  std::vector<std::string> end_components(Clock::time_point deadline,
                                          const std::function<void()>& before_saving);
  void tick();
  std::vector<Problem> problems_of(const ComponentConfig& component, const ProbedComponent& found);
  ComponentSlot* find(std::uint64_t id);
  void doing(std::string what) {
    const std::lock_guard lock(activity_mutex);
    activity = std::move(what);
  }

  SystemConfig config;
  ProbedSystem probed;
  Environment environment;
  std::shared_ptr<Logger> log;
  mutable std::mutex mutex;  // guards the slots
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
    add(config.components[i], probed.components.at(i)).construct();
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
      dds::ComponentSettings{config.container.name, {}, {}},
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
      [this](const std::string& name, const ParameterMap& changes) {
        const std::lock_guard lock(mutex);
        for (const auto& slot : slots) {
          if (slot->config().name == name) return slot->change_parameters(changes);
        }
        return std::vector<Problem>{{{name, 0}, "", "there is no such component"}};
      },
      [this](const std::string& name) {
        const std::lock_guard lock(mutex);
        for (const auto& slot : slots) {
          if (slot->config().name == name) return slot->probed().effective_parameters;
        }
        return ParameterMap{};
      });
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

ComponentSlot& Container::Implementation::add(const ComponentConfig& component,
                                              ProbedComponent found) {
  doing("constructing component '" + component.name + "'");
  slots.push_back(
      std::make_unique<ComponentSlot>(++last_id, component, std::move(found), environment));
  return *slots.back();
}

void Container::Implementation::tick() {
  const std::lock_guard lock(mutex);
  for (const auto& slot : slots) slot->tick(Clock::now());
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
    all_saved = slot->finish() && all_saved;
  }
  return hung;
}

ComponentSlot* Container::Implementation::find(std::uint64_t id) {
  const auto found = std::find_if(
      slots.begin(), slots.end(), [id](const auto& slot) { return slot->info().id == id; });
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
  self.doing("ending the container's own services");
  std::vector<std::string> hung;
  const bool control_ended = self.control == nullptr || self.control->deactivate(kControlTimeout);
  const bool services_ended = self.services == nullptr || self.services->end(kControlTimeout);
  if (!control_ended || !services_ended) return {self.config.container.name};
  const std::lock_guard lock(self.mutex);
  hung = self.end_components(deadline, before_saving);
  if (!hung.empty()) return hung;  // their threads live on: nothing more can be taken down
  self.doing("leaving the domain");
  self.slots.clear();
  self.services.reset();
  self.diagnostics.reset();
  self.control.reset();
  self.control_executor.reset();
  self.environment.executors.clear();
  self.environment.middleware = {};
  self.running = false;
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
  const std::lock_guard lock(self.mutex);
  if (!self.running) throw std::runtime_error("the container does not run");
  if (const auto problems = self.problems_of(component, found); !problems.empty()) {
    throw std::runtime_error(join(problems));
  }
  auto& slot = self.add(component, found);
  slot.construct();
  slot.launch();
  self.services->add_component(component.name);
  self.doing("running");
  return slot.info();
}

void Container::unload(std::uint64_t id) {
  auto& self = *implementation_;
  const std::lock_guard lock(self.mutex);
  auto* slot = self.find(id);
  if (slot == nullptr)
    throw std::runtime_error(fmt::format("No node found with unique_id: {}", id));
  if (!slot->end(Clock::now() + kUnloadTimeout)) {
    throw std::runtime_error("component '" + slot->config().name +
                             "' hangs and cannot be unloaded");
  }
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
