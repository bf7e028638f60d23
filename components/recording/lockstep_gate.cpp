#include "camvox/recording/lockstep_gate.hpp"

#include <algorithm>
#include <limits>

namespace camvox::recording {

LockstepGate::LockstepGate(std::vector<std::string> components, std::size_t frames_in_flight)
    : frames_in_flight_(frames_in_flight) {
  for (auto& component : components) {
    done_[std::move(component)] = std::numeric_limits<std::int64_t>::min();
  }
}

bool LockstepGate::may_send() const {
  const std::lock_guard lock(mutex_);
  return done_.empty() || in_flight_.size() < frames_in_flight_;
}

void LockstepGate::sent(std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  if (!done_.empty()) in_flight_.push_back(stamp_ns);
}

void LockstepGate::done(const std::string& component, std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  const auto found = done_.find(component);
  if (found == done_.end()) return;
  found->second = std::max(found->second, stamp_ns);
  const auto slowest =
      std::min_element(done_.begin(), done_.end(), [](const auto& a, const auto& b) {
        return a.second < b.second;
      })->second;
  while (!in_flight_.empty() && in_flight_.front() <= slowest) in_flight_.pop_front();
}

}  // namespace camvox::recording
