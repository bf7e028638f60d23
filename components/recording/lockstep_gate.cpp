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

std::vector<std::string> LockstepGate::waits_for() const {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, done] : done_) {
    if (!in_flight_.empty() && done.stamp_ns < in_flight_.front()) names.push_back(name);
  }
  return names;
}

void LockstepGate::sent(std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  if (done_.empty() || last_sent_ns_ == stamp_ns) return;
  last_sent_ns_ = stamp_ns;
  in_flight_.push_back(stamp_ns);
}

void LockstepGate::left_out(std::int64_t stamp_ns) {
  const std::lock_guard lock(mutex_);
  auto image = in_flight_.end();
  for (auto i = in_flight_.begin(); i != in_flight_.end(); ++i) {
    if (*i <= stamp_ns && (image == in_flight_.end() || *i > *image)) image = i;
  }
  if (image == in_flight_.end()) return;
  in_flight_.erase(image);
  release();
}

void LockstepGate::done(const std::string& component,
                        std::int64_t stamp_ns,
                        std::uint64_t frame_id) {
  if (frame_id == 0) return left_out(stamp_ns);
  const std::lock_guard lock(mutex_);
  const auto found = done_.find(component);
  if (found == done_.end()) return;
  found->second.stamp_ns = std::max(found->second.stamp_ns, stamp_ns);
  found->second.frame_id = std::max(found->second.frame_id, frame_id);
  release();
}

void LockstepGate::release() {
  const auto slowest =
      std::min_element(done_.begin(), done_.end(), [](const auto& a, const auto& b) {
        return a.second.stamp_ns < b.second.stamp_ns;
      })->second.stamp_ns;
  while (!in_flight_.empty() && in_flight_.front() <= slowest) in_flight_.pop_front();
}

}  // namespace camvox::recording
