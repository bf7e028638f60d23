#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "camvox/mapping/bundle_job.hpp"

namespace camvox::mapping_component {

/// Solves bundle adjustments on a thread of its own, one at a time.
class JobRunner {
 public:
  /// `done` gets each solved job and the processor time that it took, on the runner's thread.
  using Done = std::function<void(
      mapping::BundleJob job, optimization::BundleSummary summary, double time_s)>;

  explicit JobRunner(Done done);
  JobRunner(const JobRunner&) = delete;
  JobRunner& operator=(const JobRunner&) = delete;
  ~JobRunner();

  /// Only while not busy, else std::logic_error.
  void start(mapping::BundleJob job);
  /// Lets the present job end after its iteration; what it found so far counts.
  void interrupt() { interrupted_ = true; }
  /// From start until the job is solved.
  [[nodiscard]] bool busy() const { return busy_; }

 private:
  void run();

  Done done_;
  std::atomic<bool> interrupted_ = false;
  std::atomic<bool> busy_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<mapping::BundleJob> job_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace camvox::mapping_component
