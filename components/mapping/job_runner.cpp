#include "camvox/mapping_component/job_runner.hpp"

#include <stdexcept>
#include <utility>

#include "camvox/component/background_thread.hpp"
#include "camvox/component/progress.hpp"

namespace camvox::mapping_component {

namespace {

SolvedJob solve(mapping::BundleJob job, const std::atomic<bool>& stop) {
  SolvedJob solved{.job = std::move(job), .summary = {}, .time_s = 0.0, .error = nullptr};
  const double started_s = thread_processor_time_s();
  try {
    solved.summary = solved.job.solve(&stop);
  } catch (...) {
    solved.error = std::current_exception();
  }
  solved.time_s = thread_processor_time_s() - started_s;
  return solved;
}

}  // namespace

JobRunner::JobRunner(std::function<void(SolvedJob)> done)
    : done_(std::move(done)), thread_([this] { run(); }) {}

JobRunner::~JobRunner() {
  interrupt();
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void JobRunner::start(mapping::BundleJob job) {
  if (std::exchange(busy_, true)) throw std::logic_error("JobRunner: a job is under way");
  interrupted_ = false;
  {
    const std::lock_guard lock(mutex_);
    job_ = std::move(job);
  }
  changed_.notify_all();
}

void JobRunner::run() {
  make_background_thread();
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || job_.has_value(); });
    if (ending_) return;
    mapping::BundleJob job = *std::exchange(job_, std::nullopt);
    lock.unlock();
    done_(solve(std::move(job), interrupted_));
    lock.lock();
  }
}

}  // namespace camvox::mapping_component
