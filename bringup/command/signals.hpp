#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <thread>

namespace camvox::command {

/// Keeps SIGINT and SIGTERM for StopSignal; called before any thread is made.
void block_stop_signals();

/// A latch that threads and signals open: a file descriptor to wait for.
class Event {
 public:
  Event();
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  ~Event();
  void set();
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

/// Waits for SIGINT, SIGTERM, or a request of the program itself.
class StopSignal {
 public:
  StopSignal();
  StopSignal(const StopSignal&) = delete;
  StopSignal& operator=(const StopSignal&) = delete;
  ~StopSignal();

  /// True: it is time to stop. False: the timeout came first. No timeout: waits for ever.
  bool wait(std::optional<std::chrono::milliseconds> timeout = {});
  /// Ends the wait; from any thread.
  void request() { requested_.set(); }

 private:
  int signals_;
  Event requested_;
};

/// Receives the signals of a process that must end soon after the first: if it does not,
/// `on_overdue` says what hangs and the process exits with kUnclean. A second signal exits at once,
/// unless it follows the first at once: `timeout` and shells send one to the process and to its
/// group.
class ExitGuard {
 public:
  ExitGuard(std::chrono::milliseconds patience,
            std::function<void()> on_overdue,
            std::function<void(const char*)> tell);
  ExitGuard(const ExitGuard&) = delete;
  ExitGuard& operator=(const ExitGuard&) = delete;
  ~ExitGuard();

  /// Waits for the first signal, or request().
  void wait();
  /// Ends the wait although no signal came; from any thread.
  void request() { asked_.set(); }
  /// Gives more time, counted from now, to end in.
  void extend(std::chrono::milliseconds patience);

 private:
  void watch();

  std::chrono::milliseconds patience_;
  std::atomic<std::chrono::steady_clock::time_point> deadline_{};
  std::function<void()> on_overdue_;
  std::function<void(const char*)> tell_;  ///< What signals do.
  StopSignal signal_;
  Event asked_;
  Event over_;
  std::thread thread_;
};

}  // namespace camvox::command
