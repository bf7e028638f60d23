#pragma once

#include <functional>
#include <memory>

#include "camvox/component/context.hpp"
#include "camvox/mapping/mapper.hpp"
#include "camvox/mapping_component/job_runner.hpp"

namespace camvox::mapping_component {

/// Live, decides which bundle adjustment is solved when. The surroundings of the newest keyframe
/// and the whole map have a thread each: a new keyframe interrupts the former, whose result counts
/// as far as it came; the latter takes seconds, goes on beside it on the map as it was, and carries
/// what came since along. To be called on the component's thread.
class JobSchedule {
 public:
  /// Brings a solved job into the map; false when it is void. On the component's thread.
  using Finish = std::function<bool(const SolvedJob&)>;

  /// The context and the mapper must outlive it.
  JobSchedule(Context& context, const mapping::Mapper& mapper, Finish finish);

  /// The surroundings of a new keyframe are to be adjusted.
  void want_local(mapping::KeyframeId id);
  /// The whole map is to be adjusted.
  void want_full() { full_due_ = true; }
  /// What is under way has become void, so that going on is in vain; it will be cut anew.
  void interrupt();
  /// Starts what is due and has its thread free.
  void start_due();
  /// Ends the threads; what is under way is lost.
  void stop();

 private:
  using Runner = std::unique_ptr<JobRunner>;

  [[nodiscard]] Runner make_runner(Runner& place);
  void on_solved(JobRunner* runner, const SolvedJob& solved);
  void start_local();
  void start_full();

  Context& context_;
  const mapping::Mapper& mapper_;
  Finish finish_;
  mapping::KeyframeId local_due_ = 0;  ///< 0: none.
  bool full_due_ = false;
  Runner local_;
  Runner full_;
};

}  // namespace camvox::mapping_component
