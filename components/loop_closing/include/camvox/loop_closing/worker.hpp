#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace camvox::loop_closing {

/// One thread that does what it is given, in order. A task may add others.
class Worker {
 public:
  using Task = std::function<void()>;

  /// Begins; what is thrown by a task goes to `on_error`, on the worker's thread.
  explicit Worker(std::function<void(std::exception_ptr)> on_error);
  /// Ends after the task under way; those that wait are dropped.
  ~Worker();
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  void add(Task task);
  /// Tasks that wait or are under way.
  [[nodiscard]] std::size_t busy() const;

 private:
  void run();

  std::function<void(std::exception_ptr)> on_error_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Task> tasks_;
  bool working_ = false;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace camvox::loop_closing
