#include "camvox/recording/lockstep_gate.hpp"

#include <algorithm>

namespace camvox::recording {

LockstepGate::LockstepGate(std::vector<std::string> components, std::size_t frames_in_flight)
    : frames_in_flight_(frames_in_flight) {
  for (auto& component : components) done_[std::move(component)] = {};
}

bool LockstepGate::may_send() const {
  const std::lock_guard lock(mutex_);
  return done_.empty() || in_flight_.size() < frames_in_flight_;
}

std::vector<std::string> LockstepGate::behind() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t newest = 0;
  for (const auto& [name, done] : done_) newest = std::max(newest, done.frame_id);
  std::vector<std::string> names;
  for (const auto& [name, done] : done_) {
    if (done.frame_id < newest) names.push_back(name);
  }
  return names;
}

void LockstepGate::sent(std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  if (!done_.empty()) in_flight_.push_back(stamp_ns);
}

void LockstepGate::done(const std::string& component,
                        std::int64_t stamp_ns,
                        std::uint64_t frame_id) {
  const std::lock_guard lock(mutex_);
  const auto found = done_.find(component);
  if (found == done_.end()) return;
  found->second.stamp_ns = std::max(found->second.stamp_ns, stamp_ns);
  found->second.frame_id = std::max(found->second.frame_id, frame_id);
  const auto slowest =
      std::min_element(done_.begin(), done_.end(), [](const auto& a, const auto& b) {
        return a.second.stamp_ns < b.second.stamp_ns;
      })->second.stamp_ns;
  while (!in_flight_.empty() && in_flight_.front() <= slowest) in_flight_.pop_front();
}

}  // namespace camvox::recording
