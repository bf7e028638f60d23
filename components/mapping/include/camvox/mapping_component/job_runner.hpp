#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "camvox/mapping/bundle_job.hpp"

namespace camvox::mapping_component {

/// A job that came out of the runner.
struct SolvedJob {
  mapping::BundleJob job;
  optimization::BundleSummary summary;
  double time_s = 0.0;       ///< Processor time that it took.
  std::exception_ptr error;  ///< What solving it threw, if anything; then the job is void.
};

/// Solves bundle adjustments on a thread of its own, one at a time. Its owner calls it from one
/// thread.
class JobRunner {
 public:
  /// `done` gets each solved job, on the runner's thread.
  explicit JobRunner(std::function<void(SolvedJob)> done);
  JobRunner(const JobRunner&) = delete;
  JobRunner& operator=(const JobRunner&) = delete;
  ~JobRunner();

  /// Only while not busy, else std::logic_error.
  void start(mapping::BundleJob job);
  /// Lets the present job end after its iteration.
  void interrupt() { interrupted_ = true; }
  /// From start until release, so that no job is cut from a map that the one before has yet to
  /// change.
  [[nodiscard]] bool busy() const { return busy_; }
  /// The owner has seen to the solved job.
  void release() { busy_ = false; }

 private:
  void run();

  std::function<void(SolvedJob)> done_;
  bool busy_ = false;
  std::atomic<bool> interrupted_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<mapping::BundleJob> job_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace camvox::mapping_component
