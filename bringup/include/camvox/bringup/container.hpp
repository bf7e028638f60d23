#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "camvox/bringup/console_logger.hpp"
#include "camvox/bringup/plugin_loader.hpp"
#include "camvox/bringup/probe.hpp"
#include "camvox/bringup/system_config.hpp"

namespace camvox::bringup {

/// The config with ROS_DOMAIN_ID, ROS_LOCALHOST_ONLY, ROS_AUTOMATIC_DISCOVERY_RANGE and
/// ROS_STATIC_PEERS applied where they are set. Throws std::runtime_error naming a variable with an
/// impossible value.
[[nodiscard]] ContainerConfig with_ros_environment(ContainerConfig config);

enum class ComponentState {
  kRunning,
  kRestarting,  ///< Failed, and waits for its next start.
  kStopped,     ///< Failed for good (on_error: stop), or not started yet.
  kHung,        ///< A callback did not return when the component had to end.
};

/// What a container tells of one of its components.
struct ComponentInfo {
  std::uint64_t id = 0;  ///< Counts from 1; never used twice in a container.
  std::string name;
  std::string plugin;
  ComponentState state = ComponentState::kStopped;
  std::uint64_t errors = 0;  ///< Exceptions that left the component.
  std::uint64_t restarts = 0;
  std::string last_error;
  bool overdue = false;  ///< A callback is running for longer than the watchdog time.
};

/// A process' set of components on one DDS participant. Thread-safe.
///
/// It keeps the others alive when one fails: exceptions stop, restart (after 0.1 s, doubling to
/// 5 s) or leave the component as its `on_error` says. It publishes /diagnostics and serves the
/// composition and parameter services of ROS 2.
class Container {
 public:
  /// `probed` is what probe_system gave for the config, without problems.
  Container(SystemConfig config,
            ProbedSystem probed,
            std::shared_ptr<PluginLoader> plugins,
            LoggerFactory loggers);
  Container(const Container&) = delete;
  Container& operator=(const Container&) = delete;
  ~Container();

  /// Joins the domain, makes all components, then starts them. Throws std::runtime_error that says
  /// what is missing; components that fail are handled as the config says.
  void start();

  /// Ends all components and leaves the domain. Returns the names of components that hang; the
  /// process must then end without destructors (std::_Exit), because their threads live on.
  /// `timeout` is for callbacks to return; then `before_saving` is called, and each component
  /// saves its results, however long that takes. The container's own name is among them if its
  /// services hang; the components have saved by then.
  std::vector<std::string> stop(std::chrono::milliseconds timeout = std::chrono::milliseconds(1500),
                                const std::function<void()>& before_saving = {});

  /// After stop: whether every component could save its results.
  [[nodiscard]] bool all_saved() const;

  /// What to do when a component has finished its work (Context::request_exit); before start.
  /// Called on a component's thread, so it must not call stop itself.
  void on_exit_request(std::function<void()> callback);

  /// Adds a component. Throws std::runtime_error with all reasons why it cannot be.
  ComponentInfo load(const ComponentConfig& component);
  /// Ends and removes a component. Throws std::runtime_error if there is none, or it hangs.
  void unload(std::uint64_t id);
  [[nodiscard]] std::vector<ComponentInfo> components() const;

  /// What is being done now that could take long ("ending component 'sync'"), for the message of
  /// whoever loses patience.
  [[nodiscard]] std::string current_activity() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace camvox::bringup
