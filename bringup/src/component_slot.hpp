#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "camvox/bringup/console_logger.hpp"
#include "camvox/bringup/container.hpp"
#include "camvox/bringup/plugin_loader.hpp"
#include "camvox/bringup/probe.hpp"
#include "camvox/dds/component_context.hpp"
#include "executor_pool.hpp"

namespace camvox::bringup {

/// What every component of a container is built on.
struct Environment {
  std::shared_ptr<PluginLoader> plugins;
  LoggerFactory make_logger;
  dds::Middleware middleware;
  ExecutorPool executors;
  std::function<void()> exit_request;  ///< What Context::request_exit of a component does.
};

/// One component from its construction to its end, with what happens when it fails. Not
/// thread-safe: the container calls it under its lock; only failures come from other threads.
class ComponentSlot {
 public:
  using Clock = std::chrono::steady_clock;

  ComponentSlot(std::uint64_t id,
                ComponentConfig config,
                ProbedComponent probed,
                Environment& environment);

  /// Makes the component and its endpoints; a failure is handled as the config says.
  void construct();
  /// Starts the component on its thread, and then delivery.
  void launch();
  /// No callback begins any more; the first step of ending several components at once.
  void close();
  /// Ends delivery. False: a callback of it does not return; everything that it might still touch
  /// is kept until the process ends.
  bool halt(Clock::time_point deadline);
  /// After halt: lets the component save its results, and takes it down. False: it could not save.
  bool finish();
  /// Both.
  bool end(Clock::time_point deadline) {
    if (!halt(deadline)) return false;
    finish();
    return true;
  }
  /// Carries out what a failure asks for, and looks after the watchdog. Called often.
  void tick(Clock::time_point now);

  [[nodiscard]] std::vector<Problem> change_parameters(const ParameterMap& changes);

  [[nodiscard]] ComponentInfo info() const;
  [[nodiscard]] Diagnostics::Status health();
  [[nodiscard]] const ComponentConfig& config() const { return config_; }
  [[nodiscard]] const ProbedComponent& probed() const { return probed_; }

 private:
  /// Shared with the component's thread, which outlives the slot when it hangs.
  struct Failures {
    std::string policy;  ///< on_error
    std::shared_ptr<Logger> log;
    std::atomic<std::uint64_t> count = 0;
    std::atomic<bool> pending = false;  ///< Something is to be done about it in tick().
    std::atomic<bool> exit_requested = false;
    std::mutex mutex;
    std::string last;
    std::weak_ptr<dds::Tenant> tenant;

    void add(const std::exception_ptr& error);
  };

  void try_construct();
  void handle_failure(Clock::time_point now);
  void watch(Clock::time_point now);
  [[nodiscard]] bool is_idle() const;
  void abandon();

  std::uint64_t id_;
  ComponentConfig config_;
  ProbedComponent probed_;
  Environment& environment_;
  std::shared_ptr<Logger> log_;
  std::shared_ptr<Failures> failures_ = std::make_shared<Failures>();
  std::shared_ptr<dds::Executor> executor_;
  std::shared_ptr<ComponentFactory> factory_;
  std::unique_ptr<dds::ComponentContext> context_;
  std::unique_ptr<Component> component_;
  ComponentState state_ = ComponentState::kStopped;
  std::uint64_t restarts_ = 0;
  std::uint64_t reported_failures_ = 0;
  std::chrono::milliseconds back_off_{};
  Clock::time_point restart_at_{};
  Clock::time_point launched_at_{};
  bool hang_reported_ = false;
  std::shared_ptr<std::atomic<bool>> started_;  ///< start() returned: there may be results.
};

}  // namespace camvox::bringup
