#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace eprosima::fastdds::dds {
class Condition;
}

namespace camvox::dds {

/// One component on an executor. Its callbacks run through `invoke`, which times them for the
/// watchdog and hands exceptions to `on_error`; a closed tenant's callbacks are not run any more.
class Tenant {
 public:
  Tenant(std::string name, std::function<void(std::exception_ptr)> on_error)
      : name_(std::move(name)), on_error_(std::move(on_error)) {}

  [[nodiscard]] const std::string& name() const { return name_; }
  void invoke(const std::function<void()>& callback);
  /// Hands an exception to `on_error`.
  void report(std::exception_ptr error) const { on_error_(error); }
  void close() { open_ = false; }
  [[nodiscard]] bool open() const { return open_; }
  /// How long the callback that runs now has been running; zero when none does.
  [[nodiscard]] std::chrono::nanoseconds busy_time() const;

 private:
  std::string name_;
  std::function<void(std::exception_ptr)> on_error_;
  std::atomic<bool> open_ = true;
  std::atomic<std::int64_t> busy_since_ns_ = 0;  // steady clock; 0: idle
};

/// A thread that waits for data, timers and posted work, and runs one callback at a time.
class Executor {
 public:
  /// Handles one message and returns true, or returns false when there is none left.
  using TakeOne = std::function<bool()>;

  explicit Executor(std::string name);
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;
  ~Executor();

  [[nodiscard]] const std::string& name() const;
  void start();
  /// Ends the thread after the callback that runs now. False: that callback did not return in time
  /// (the thread is then left behind and must not be destroyed before the process ends).
  bool stop(std::chrono::milliseconds timeout);

  /// Watches a condition; `take_one` is called on the thread until it returns false.
  void add_source(std::shared_ptr<Tenant> tenant,
                  eprosima::fastdds::dds::Condition* condition,
                  TakeOne take_one);
  void every(std::shared_ptr<Tenant> tenant,
             std::chrono::nanoseconds period,
             std::function<void()> callback);
  /// Runs something once on the thread; from any thread.
  void post(std::shared_ptr<Tenant> tenant, std::function<void()> callback);
  /// Makes the thread look at all of its sources again; works from any thread, and does nothing
  /// once the executor is gone.
  [[nodiscard]] std::function<void()> waker() const;
  /// True: the thread has nothing to do but wait for news, and its sources have none. Asked on the
  /// thread itself: there is nothing left but the callback that asks.
  [[nodiscard]] bool idle() const;
  /// How often the thread has begun to wait.
  [[nodiscard]] std::uint64_t waits() const;
  /// Drops the sources, timers and posted work of a tenant. On return nothing of it runs any more
  /// (unless called from one of its own callbacks). False: a callback of it did not end in time.
  bool remove(const std::shared_ptr<Tenant>& tenant, std::chrono::milliseconds timeout);

 private:
  struct Implementation;
  std::shared_ptr<Implementation> implementation_;
};

/// True if no executor has anything left to do, so that only timers, other threads or other
/// processes can give them more: what one handed to the other has been seen to as well.
[[nodiscard]] bool all_idle(const std::vector<std::shared_ptr<Executor>>& executors);

}  // namespace camvox::dds
