#include "camvox/mapping_component/job_runner.hpp"

#include <stdexcept>
#include <utility>

#include "camvox/component/background_thread.hpp"
#include "camvox/component/progress.hpp"

namespace camvox::mapping_component {

JobRunner::JobRunner(Done done) : done_(std::move(done)), thread_([this] { run(); }) {}

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
  if (busy_.exchange(true)) throw std::logic_error("JobRunner: a job is under way");
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
    const double started_s = thread_processor_time_s();
    const auto summary = job.solve(&interrupted_);
    const double time_s = thread_processor_time_s() - started_s;
    busy_ = false;  // before `done` tells, so that who is told may start the next
    done_(std::move(job), summary, time_s);
    lock.lock();
  }
}

}  // namespace camvox::mapping_component
