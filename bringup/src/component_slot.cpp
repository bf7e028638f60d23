#include "component_slot.hpp"

#include <fmt/format.h>

#include <utility>
#include <vector>

namespace camvox::bringup {
namespace {

using namespace std::chrono_literals;

constexpr auto kFirstBackOff = 100ms;
constexpr std::chrono::milliseconds kLongestBackOff = 5s;
constexpr auto kHealthyAfter = 10s;  // a component that ran this long starts over at 0.1 s
constexpr auto kFailedTearDown = 500ms;

/// Owns, to the end of the process, what a hung thread may still touch.
void keep_for_ever(std::shared_ptr<void> thing) {
  static auto* kept = new std::vector<std::shared_ptr<void>>();  // outlives static destruction
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  kept->push_back(std::move(thing));
}

dds::ComponentSettings settings_of(const ComponentConfig& config, std::uint64_t earlier_runs) {
  dds::ComponentSettings settings{config.name, config.parameters, {}, earlier_runs};
  for (const auto& [port, target] : config.remap) settings.remap[port] = target.topic;
  return settings;
}

const char* to_string(ComponentState state) {
  switch (state) {
    case ComponentState::kRunning:
      return "running";
    case ComponentState::kRestarting:
      return "restarting";
    case ComponentState::kHung:
      return "hung";
    default:
      return "stopped";
  }
}

double to_seconds(std::chrono::nanoseconds time) {
  return std::chrono::duration<double>(time).count();
}

template <typename Future>
bool runs(const Future& work) {
  return work.valid() && work.wait_for(0s) != std::future_status::ready;
}

}  // namespace

ComponentSlot::ComponentSlot(std::uint64_t id,
                             ComponentConfig config,
                             ProbedComponent probed,
                             Environment& environment)
    : id_(id),
      config_(std::move(config)),
      probed_(std::move(probed)),
      environment_(environment),
      log_(environment.make_logger(config_.name)) {
  failures_->policy = config_.on_error;
  failures_->log = log_;
}

void ComponentSlot::construct() {
  constructed_ = {};
  try {
    try_construct();
  } catch (...) {
    failures_->fail(std::current_exception());
  }
}

void ComponentSlot::try_construct() {
  if (executor_ == nullptr) {
    executor_ = config_.executor.empty() ? environment_.executors.make(config_.name)
                                         : environment_.executors.shared(config_.executor);
  }
  auto parts = std::make_shared<Parts>();
  parts->factory = environment_.plugins->factory(config_.plugin);
  auto settings = settings_of(config_, environment_.runs[config_.name]++);
  settings.restart_memory = restart_memory_;
  parts->context = std::make_unique<dds::ComponentContext>(
      std::move(settings),
      environment_.middleware,
      executor_,
      log_,
      [failures = failures_](const std::exception_ptr& error) { failures->add(error); });
  parts->context->on_exit_request([failures = failures_] { failures->exit_requested = true; });
  {
    const std::lock_guard lock(failures_->mutex);
    failures_->tenant = parts->context->tenant();
  }
  parts_ = std::move(parts);
  constructed_ = std::async(std::launch::async, [parts = parts_.get(), failures = failures_] {
                   try {
                     parts->component = parts->factory->create(*parts->context);
                   } catch (...) {
                     failures->fail(std::current_exception());
                   }
                 }).share();
}

bool ComponentSlot::is_under_construction() const { return runs(constructed_); }

bool ComponentSlot::saves() const { return runs(saved_); }

void ComponentSlot::launch() {
  if (!constructed_.valid() || is_under_construction()) return;
  constructed_ = {};
  if (parts_->component == nullptr) return;
  state_ = ComponentState::kRunning;
  launched_at_ = Clock::now();
  executor_->post(parts_->context->tenant(), [parts = parts_.get()] {
    parts->component->start();
    parts->started = true;
    parts->context->activate();  // after start(), so that no message comes before it
  });
}

void ComponentSlot::Failures::add(const std::exception_ptr& error) {
  const std::string text = describe(error);
  ++count;
  const std::lock_guard lock(mutex);
  last = text;
  if (policy == "ignore") {
    log->warn("error ignored: {}", text);
    return;
  }
  if (const auto failed = tenant.lock()) failed->close();
  pending = true;  // the rest is done in tick(), on another thread
  // Last: who reads it and ends the container at once must get the exit code that it made.
  log->error("{} after an error: {}", policy == "stop" ? "stops" : "restarts", text);
}

void ComponentSlot::Failures::fail(const std::exception_ptr& error) {
  add(error);
  pending = true;
}

bool ComponentSlot::is_idle() const {
  return parts_ == nullptr || parts_->context->tenant()->busy_time().count() == 0;
}

void ComponentSlot::tick(Clock::time_point now) {
  if (is_under_construction()) return;
  launch();
  // Not before the callback that asked is over: if it failed, the exit code must say so.
  const bool exits = failures_->exit_requested && is_idle();
  if (failures_->pending.exchange(false)) handle_failure(now);
  if (state_ == ComponentState::kRestarting && now >= restart_at_ && !saves()) {
    ++restarts_;
    construct();
  }
  if (state_ == ComponentState::kRunning) watch(now);
  if (exits && failures_->exit_requested.exchange(false) && environment_.exit_request) {
    environment_.exit_request();
  }
}

void ComponentSlot::handle_failure(Clock::time_point now) {
  const bool was_running = state_ == ComponentState::kRunning;
  if (!halt(now + kFailedTearDown)) return;
  save();
  if (config_.on_error != "restart") return;
  const bool first = back_off_ == 0ms || (was_running && now - launched_at_ > kHealthyAfter);
  back_off_ = first ? kFirstBackOff : std::min(2 * back_off_, kLongestBackOff);
  restart_at_ = now + back_off_;
  state_ = ComponentState::kRestarting;
}

void ComponentSlot::watch(Clock::time_point) {
  if (config_.watchdog_s <= 0.0) return;
  const double busy_s = to_seconds(parts_->context->tenant()->busy_time());
  if (busy_s <= config_.watchdog_s) {
    if (hang_reported_) log_->warn("the overdue callback has returned");
    hang_reported_ = false;
  } else if (!hang_reported_) {
    hang_reported_ = true;
    log_->error(
        "a callback has been running for {:.1f} s (watchdog_s is {})", busy_s, config_.watchdog_s);
  }
}

void ComponentSlot::close() {
  if (parts_ != nullptr) parts_->context->tenant()->close();
}

bool ComponentSlot::halt(Clock::time_point deadline) {
  if (state_ == ComponentState::kHung) return false;
  if (parts_ == nullptr) return true;
  if (constructed_.valid() && constructed_.wait_until(deadline) != std::future_status::ready) {
    log_->error("hangs: its constructor does not return");
    abandon();
    return false;
  }
  const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now());
  if (parts_->context->deactivate(std::max(left, 0ms))) return true;
  log_->error("hangs: a callback has been running for {:.1f} s and does not return",
              to_seconds(parts_->context->tenant()->busy_time()));
  abandon();
  return false;
}

std::shared_future<bool> ComponentSlot::save() {
  state_ = ComponentState::kStopped;
  constructed_ = {};
  if (parts_ == nullptr && saved_.valid()) return saved_;
  saved_ = std::async(std::launch::async,
                      [parts = std::exchange(parts_, nullptr), log = log_]() mutable {
                        const bool saved = parts == nullptr || parts->stop(*log);
                        parts.reset();
                        return saved;
                      })
               .share();
  return saved_;
}

/// False: the component could not save its results.
bool ComponentSlot::Parts::stop(Logger& log) const {
  if (!started) return true;
  try {
    component->stop();
  } catch (...) {
    log.error("while stopping: {}", describe(std::current_exception()));
    return false;
  }
  return true;
}

void ComponentSlot::abandon() {
  state_ = ComponentState::kHung;
  keep_for_ever(std::make_shared<std::shared_future<void>>(std::exchange(constructed_, {})));
  keep_for_ever(std::exchange(parts_, nullptr));
  keep_for_ever(executor_);
  keep_for_ever(environment_.plugins);
}

std::future<std::vector<Problem>> ComponentSlot::request_change(const ParameterMap& changes) {
  if (state_ == ComponentState::kRunning) return parts_->context->request_change(changes);
  std::promise<std::vector<Problem>> answer;
  answer.set_value({{{config_.name, 0}, "", "the component does not run"}});
  return answer.get_future();
}

void ComponentSlot::keep_parameters(const ParameterMap& changes) {
  for (const auto& [key, parameter] : changes) {
    config_.parameters[key] = parameter;
    probed_.effective_parameters[key] = parameter;
  }
}

ComponentInfo ComponentSlot::info() const {
  auto state = state_;
  if (state == ComponentState::kRunning && failures_->pending) {  // not yet seen to by tick()
    state = config_.on_error == "restart" ? ComponentState::kRestarting : ComponentState::kStopped;
  }
  const std::lock_guard lock(failures_->mutex);
  return {id_,
          config_.name,
          config_.plugin,
          state,
          failures_->count,
          restarts_,
          failures_->last,
          hang_reported_ || state_ == ComponentState::kHung};
}

Diagnostics::Status ComponentSlot::health() {
  const ComponentInfo now = info();
  Diagnostics::Status status;
  if (parts_ != nullptr) status = parts_->context->diagnostics().status();
  if (constructed_.valid()) {
    status.level = HealthLevel::kWarn;
    status.message = "is being constructed";
  } else if (now.state == ComponentState::kHung) {
    status.level = HealthLevel::kError;
    status.message = "hangs: a callback does not return";
  } else if (now.state == ComponentState::kStopped) {
    status.level = HealthLevel::kError;
    status.message = "stopped after an error: " + now.last_error;
  } else if (now.state == ComponentState::kRestarting) {
    status.level = HealthLevel::kError;
    status.message = "waits for its restart after an error: " + now.last_error;
  } else if (now.overdue) {
    status.level = HealthLevel::kError;
    status.message = fmt::format("a callback has been running for {:.1f} s",
                                 to_seconds(parts_->context->tenant()->busy_time()));
  } else if (now.errors > reported_failures_ && status.level == HealthLevel::kOk) {
    status.level = HealthLevel::kWarn;
    status.message = "error: " + now.last_error;
  }
  reported_failures_ = now.errors;
  status.values["state"] = to_string(now.state);
  status.values["errors"] = std::to_string(now.errors);
  status.values["restarts"] = std::to_string(now.restarts);
  if (parts_ == nullptr) return status;
  for (const auto& [topic, stats] : parts_->context->subscription_stats()) {
    status.values[topic + " received"] = std::to_string(stats.received);
    status.values[topic + " lost"] = std::to_string(stats.lost);
    status.values[topic + " rejected"] = std::to_string(stats.rejected);
    status.values[topic + " starved"] = std::to_string(stats.starved);
  }
  for (const auto& [topic, messages] : parts_->context->unsent()) {
    status.values[topic + " unsent"] = std::to_string(messages);
  }
  return status;
}

}  // namespace camvox::bringup
