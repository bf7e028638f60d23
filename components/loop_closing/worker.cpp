#include "camvox/loop_closing/worker.hpp"

#include <exception>
#include <utility>

#include "camvox/component/background_thread.hpp"

namespace camvox::loop_closing {

Worker::Worker(std::function<void(std::exception_ptr)> on_error)
    : on_error_(std::move(on_error)), thread_([this] { run(); }) {}

Worker::~Worker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void Worker::add(Task task) {
  {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(std::move(task));
  }
  wake_.notify_one();
}

std::size_t Worker::busy() const {
  const std::lock_guard lock(mutex_);
  return tasks_.size() + (working_ ? 1 : 0);
}

void Worker::run() {
  make_background_thread();
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || !tasks_.empty(); });
    if (ending_) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    working_ = true;
    lock.unlock();
    try {
      task();
    } catch (...) {
      on_error_(std::current_exception());
    }
    task = nullptr;  // what it holds goes before the next one waits
    lock.lock();
    working_ = false;
  }
}

}  // namespace camvox::loop_closing
