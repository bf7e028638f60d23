#include "camvox/component/progress.hpp"

#include <algorithm>
#include <ctime>

namespace camvox {

using camvox_interfaces::msg::Progress;

double thread_processor_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

ProgressReporter::ProgressReporter(Context& context, const Port& port)
    : name_(context.name()),
      publisher_(context.advertise<Progress>(port, {.qos = qos::kKeyframes})) {}

void ProgressReporter::resume() {
  if (depth_++ == 0) resumed_at_s_ = thread_processor_time_s();
}

void ProgressReporter::pause() {
  if (--depth_ == 0) measured_s_ += thread_processor_time_s() - resumed_at_s_;
}

void ProgressReporter::done(const camvox_interfaces::msg::MessageHeader& header) {
  if (depth_ > 0) {
    const double now_s = thread_processor_time_s();
    measured_s_ += now_s - resumed_at_s_;
    resumed_at_s_ = now_s;
  }
  auto message = publisher_.loan();
  message->header() = header;
  message->processing_time_s() = measured_s_;
  auto& name = message->component_name();
  std::copy_n(name_.begin(), std::min(name_.size(), name.size() - 1), name.begin());
  publisher_.publish(std::move(message));
  measured_s_ = 0.0;
}

}  // namespace camvox
