#pragma once

#include <any>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <map>
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
  std::map<std::string, std::uint64_t> runs;  ///< How often a component was made, by its name.
  std::function<void()> exit_request;         ///< What Context::request_exit of a component does.
};

/// One component from its construction to its end, with what happens when it fails. Not
/// thread-safe: the container calls it under its lock; only failures come from other threads.
/// Constructing and saving take as long as the component likes, so they run on threads of their
/// own: who holds the container's lock need not wait for them.
class ComponentSlot {
 public:
  using Clock = std::chrono::steady_clock;

  ComponentSlot(std::uint64_t id,
                ComponentConfig config,
                ProbedComponent probed,
                Environment& environment);

  /// Begins to make the component and its endpoints; a failure is handled as the config says.
  void construct();
  /// Ready when the constructor has returned; may be waited for without the lock.
  [[nodiscard]] std::shared_future<void> constructed() const { return constructed_; }
  /// Once constructed: starts the component on its thread, and then delivery.
  void launch();
  /// No callback begins any more; the first step of ending several components at once.
  void close();
  /// Ends delivery. False: a callback of it does not return; everything that it might still touch
  /// is kept until the process ends.
  bool halt(Clock::time_point deadline);
  /// After halt: the component begins to save its results, and is then taken down. The result says
  /// whether it could save; it may be waited for without the lock.
  std::shared_future<bool> save();
  /// Carries out what a failure asks for, and looks after the watchdog. Called often.
  void tick(Clock::time_point now);

  /// Asks the component to change parameters; see ComponentContext::request_change.
  [[nodiscard]] std::future<std::vector<Problem>> request_change(const ParameterMap& changes);
  /// Notes parameters that it has changed, so that a restart keeps them.
  void keep_parameters(const ParameterMap& changes);

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
    /// The same where there is nothing that `ignore` could carry on with.
    void fail(const std::exception_ptr& error);
  };

  /// What there is while the component lives; a hung thread, or one that saves, takes it along.
  struct Parts {
    std::shared_ptr<ComponentFactory> factory;
    std::unique_ptr<dds::ComponentContext> context;
    std::unique_ptr<Component> component;
    std::atomic<bool> started = false;  ///< start() returned: there may be results.

    bool stop(Logger& log) const;
  };

  void try_construct();
  [[nodiscard]] bool is_under_construction() const;
  [[nodiscard]] bool saves() const;
  void handle_failure(Clock::time_point now);
  void watch(Clock::time_point now);
  [[nodiscard]] bool is_idle() const;
  void abandon();

  std::uint64_t id_;
  ComponentConfig config_;
  ProbedComponent probed_;
  Environment& environment_;
  std::shared_ptr<std::any> restart_memory_ = std::make_shared<std::any>();
  std::shared_ptr<Logger> log_;
  std::shared_ptr<Failures> failures_ = std::make_shared<Failures>();
  std::shared_ptr<dds::Executor> executor_;
  std::shared_ptr<Parts> parts_;
  std::shared_future<void> constructed_;  ///< Valid until launched.
  std::shared_future<bool> saved_;        ///< Of the last one that ended.
  ComponentState state_ = ComponentState::kStopped;
  std::uint64_t restarts_ = 0;
  std::uint64_t reported_failures_ = 0;
  std::chrono::milliseconds back_off_{};
  Clock::time_point restart_at_{};
  Clock::time_point launched_at_{};
  bool hang_reported_ = false;
};

}  // namespace camvox::bringup
