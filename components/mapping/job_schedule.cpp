#include "camvox/mapping_component/job_schedule.hpp"

#include <algorithm>
#include <exception>
#include <utility>

namespace camvox::mapping_component {

JobSchedule::JobSchedule(Context& context, const mapping::Mapper& mapper, Finish finish)
    : context_(context),
      mapper_(mapper),
      finish_(std::move(finish)),
      local_(make_runner(local_)),
      full_(make_runner(full_)) {}

/// `place` is where the runner will be: by then it may have gone.
JobSchedule::Runner JobSchedule::make_runner(Runner& place) {
  return std::make_unique<JobRunner>([this, &place](SolvedJob solved) {
    context_.post([this, &place, solved = std::move(solved)] { on_solved(place.get(), solved); });
  });
}

void JobSchedule::want_local(mapping::KeyframeId id) {
  local_due_ = id;
  if (local_) local_->interrupt();
}

void JobSchedule::interrupt() {
  if (local_) local_->interrupt();
  if (full_) full_->interrupt();
}

void JobSchedule::stop() {
  interrupt();
  local_.reset();
  full_.reset();
}

void JobSchedule::on_solved(JobRunner* runner, const SolvedJob& solved) {
  if (runner == nullptr) return;
  runner->release();
  if (solved.error) std::rethrow_exception(solved.error);
  const bool taken = finish_(solved);
  if (!taken && solved.job.whole_map) want_full();
  if (!taken && !solved.job.whole_map) local_due_ = std::max(local_due_, solved.job.newest);
  // What came since has only been carried along.
  if (taken && solved.job.whole_map) want_local(mapper_.map().keyframes().rbegin()->first);
  start_due();
}

void JobSchedule::start_due() {
  if (full_due_ && full_ && !full_->busy()) start_full();
  if (local_due_ != 0 && local_ && !local_->busy()) start_local();
}

void JobSchedule::start_full() {
  full_due_ = false;
  auto job = mapper_.full_job();
  if (!job.empty()) full_->start(std::move(job));
}

void JobSchedule::start_local() {
  auto job = mapper_.local_job(std::exchange(local_due_, 0));
  // Where a loop still strains the map, what does not fit here may be right.
  job.keeps_outliers = full_due_ || full_->busy();
  if (!job.empty()) local_->start(std::move(job));
}

}  // namespace camvox::mapping_component
