#include "camvox/dds/executor.hpp"

#include <pthread.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <deque>
#include <fastdds/dds/core/condition/Condition.hpp>
#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <mutex>
#include <thread>
#include <vector>

namespace camvox::dds {
namespace {

using Clock = std::chrono::steady_clock;
using eprosima::fastdds::dds::Condition;
using eprosima::fastdds::dds::ConditionSeq;
using eprosima::fastdds::dds::GuardCondition;
using eprosima::fastdds::dds::WaitSet;

constexpr auto kLongestWait = std::chrono::seconds(1);

std::int64_t steady_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

struct Source {
  std::shared_ptr<Tenant> tenant;
  Condition* condition;
  Executor::TakeOne take_one;
};

struct Timer {
  std::shared_ptr<Tenant> tenant;
  Clock::duration period;
  Clock::time_point next;
  std::function<void()> callback;
};

struct Task {
  std::shared_ptr<Tenant> tenant;
  std::function<void()> callback;
};

}  // namespace

void Tenant::invoke(const std::function<void()>& callback) {
  // Busy before the check, so that who closes the tenant and then sees it idle knows that nothing
  // of it runs any more.
  busy_since_ns_ = steady_now_ns();
  if (open_) {
    try {
      callback();
    } catch (...) {
      on_error_(std::current_exception());
    }
  }
  busy_since_ns_ = 0;
}

std::chrono::nanoseconds Tenant::busy_time() const {
  const std::int64_t since = busy_since_ns_;
  return std::chrono::nanoseconds(since == 0 ? 0 : steady_now_ns() - since);
}

struct Executor::Implementation : std::enable_shared_from_this<Executor::Implementation> {
  std::string name;
  std::thread thread;
  WaitSet wait_set;
  GuardCondition wake_up;

  std::mutex mutex;
  std::condition_variable changed;
  bool stopping = false;
  bool running = false;
  std::atomic<bool> waiting = false;
  std::atomic<std::uint64_t> waits = 0;
  std::deque<Task> tasks;
  std::vector<std::shared_ptr<Source>> sources;
  std::vector<std::shared_ptr<Timer>> timers;

  void run();
  void run_tasks();
  void run_timers();
  void drain_sources();
  [[nodiscard]] bool stop_requested();
  [[nodiscard]] Clock::duration time_to_next_timer();
  template <typename List>
  [[nodiscard]] List snapshot(const List& list) {
    const std::lock_guard lock(mutex);
    return list;
  }
};

bool Executor::Implementation::stop_requested() {
  const std::lock_guard lock(mutex);
  return stopping;
}

Clock::duration Executor::Implementation::time_to_next_timer() {
  const std::lock_guard lock(mutex);
  if (!tasks.empty()) return Clock::duration::zero();
  Clock::duration wait = kLongestWait;
  const auto now = Clock::now();
  for (const auto& timer : timers) wait = std::min(wait, timer->next - now);
  return std::max(wait, Clock::duration::zero());
}

void Executor::Implementation::run_tasks() {
  for (;;) {
    Task task;
    {
      const std::lock_guard lock(mutex);
      if (tasks.empty() || stopping) return;
      task = std::move(tasks.front());
      tasks.pop_front();
    }
    task.tenant->invoke(task.callback);
  }
}

void Executor::Implementation::run_timers() {
  for (const auto& timer : snapshot(timers)) {
    const auto now = Clock::now();
    if (now < timer->next) continue;
    timer->next += timer->period;
    if (timer->next <= now) timer->next = now + timer->period;  // late by more than a period
    timer->tenant->invoke(timer->callback);
  }
}

/// One message of every source in turn, until none has any: a busy topic cannot starve another.
void Executor::Implementation::drain_sources() {
  bool any = true;
  while (any && !stop_requested()) {
    any = false;
    for (const auto& source : snapshot(sources)) {
      if (!source->tenant->open()) continue;
      bool took = true;  // also if its callback throws: there may be more
      source->tenant->invoke([&] { took = source->take_one(); });
      any = any || (took && source->tenant->open());
    }
    run_tasks();
    run_timers();
  }
}

void Executor::Implementation::run() {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
  while (!stop_requested()) {
    const auto wait = time_to_next_timer();
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(wait);
    ConditionSeq active;
    if (wait > Clock::duration::zero()) {
      ++waits;
      waiting = true;
      wait_set.wait(
          active,
          {static_cast<std::int32_t>(seconds.count()),
           static_cast<std::uint32_t>(
               std::chrono::duration_cast<std::chrono::nanoseconds>(wait - seconds).count())});
      waiting = false;
    }
    wake_up.set_trigger_value(false);
    run_tasks();
    run_timers();
    drain_sources();
  }
  const std::lock_guard lock(mutex);
  running = false;
  changed.notify_all();
}

Executor::Executor(std::string name) : implementation_(std::make_shared<Implementation>()) {
  implementation_->name = std::move(name);
  implementation_->wait_set.attach_condition(implementation_->wake_up);
}

Executor::~Executor() { stop(std::chrono::hours(1)); }

const std::string& Executor::name() const { return implementation_->name; }

void Executor::start() {
  const std::lock_guard lock(implementation_->mutex);
  if (implementation_->running || implementation_->stopping) return;
  implementation_->running = true;
  implementation_->thread = std::thread([state = implementation_] { state->run(); });
}

bool Executor::stop(std::chrono::milliseconds timeout) {
  auto& state = *implementation_;
  {
    std::unique_lock lock(state.mutex);
    state.stopping = true;
    state.wake_up.set_trigger_value(true);
    if (!state.changed.wait_for(lock, timeout, [&] { return !state.running; })) return false;
  }
  if (!state.thread.joinable()) return true;
  if (state.thread.get_id() == std::this_thread::get_id()) {
    state.thread.detach();
  } else {
    state.thread.join();
  }
  return true;
}

void Executor::add_source(std::shared_ptr<Tenant> tenant,
                          eprosima::fastdds::dds::Condition* condition,
                          TakeOne take_one) {
  auto source = std::make_shared<Source>(Source{std::move(tenant), condition, std::move(take_one)});
  implementation_->wait_set.attach_condition(*condition);
  const std::lock_guard lock(implementation_->mutex);
  implementation_->sources.push_back(std::move(source));
  implementation_->wake_up.set_trigger_value(true);  // data may be there already
}

void Executor::every(std::shared_ptr<Tenant> tenant,
                     std::chrono::nanoseconds period,
                     std::function<void()> callback) {
  auto timer = std::make_shared<Timer>(
      Timer{std::move(tenant), period, Clock::now() + period, std::move(callback)});
  const std::lock_guard lock(implementation_->mutex);
  implementation_->timers.push_back(std::move(timer));
  implementation_->wake_up.set_trigger_value(true);
}

void Executor::post(std::shared_ptr<Tenant> tenant, std::function<void()> callback) {
  const std::lock_guard lock(implementation_->mutex);
  implementation_->tasks.push_back({std::move(tenant), std::move(callback)});
  implementation_->wake_up.set_trigger_value(true);
}

std::function<void()> Executor::waker() const {
  return [state = std::weak_ptr(implementation_)] {
    if (const auto alive = state.lock()) alive->wake_up.set_trigger_value(true);
  };
}

bool Executor::idle() const {
  auto& state = *implementation_;
  const std::lock_guard lock(state.mutex);
  const bool asks_itself = state.thread.get_id() == std::this_thread::get_id();
  if (!asks_itself && (!state.waiting || state.wake_up.get_trigger_value())) return false;
  return state.tasks.empty() &&
         std::none_of(state.sources.begin(), state.sources.end(), [](const auto& source) {
           return source->tenant->open() && source->condition->get_trigger_value();
         });
}

std::uint64_t Executor::waits() const { return implementation_->waits; }

bool all_idle(const std::vector<std::shared_ptr<Executor>>& executors) {
  const auto waits = [&executors] {
    std::uint64_t sum = 0;
    for (const auto& executor : executors) sum += executor->waits();
    return sum;
  };
  // Who was at work when another one was looked at may have given it something, but has then begun
  // to wait since.
  const auto before = waits();
  return std::all_of(executors.begin(),
                     executors.end(),
                     [](const auto& executor) { return executor->idle(); }) &&
         waits() == before;
}

bool Executor::remove(const std::shared_ptr<Tenant>& tenant, std::chrono::milliseconds timeout) {
  auto& state = *implementation_;
  tenant->close();
  // The entries' closures may own endpoints: they are destroyed after the lock is released.
  std::vector<std::shared_ptr<void>> removed;
  std::vector<Task> removed_tasks;
  bool on_own_thread = false;
  {
    const std::lock_guard lock(state.mutex);
    for (const auto& source : state.sources) {
      if (source->tenant == tenant) state.wait_set.detach_condition(*source->condition);
    }
    const auto take_out = [&](auto& list) {
      const auto end = std::stable_partition(
          list.begin(), list.end(), [&](const auto& entry) { return entry->tenant != tenant; });
      removed.insert(removed.end(), end, list.end());
      list.erase(end, list.end());
    };
    take_out(state.sources);
    take_out(state.timers);
    std::deque<Task> kept;
    for (auto& task : state.tasks) {
      if (task.tenant == tenant) {
        removed_tasks.push_back(std::move(task));
      } else {
        kept.push_back(std::move(task));
      }
    }
    state.tasks = std::move(kept);
    on_own_thread = state.thread.get_id() == std::this_thread::get_id();
  }
  const auto deadline = Clock::now() + timeout;
  while (!on_own_thread && tenant->busy_time().count() > 0) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace camvox::dds
