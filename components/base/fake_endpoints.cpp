#include "fake_endpoints.hpp"

#include <fmt/format.h>

#include <cstring>

namespace camvox {
namespace {

constexpr int kJunk = 0xA5;

}  // namespace

std::shared_ptr<void> make_unclean_message(const MessageType& type) {
  auto message = interfaces::make_message(type);
  if (type.plain) std::memset(message.get(), kJunk, type.size);
  type.reset(message.get());
  return message;
}

FakePublisher::FakePublisher(std::string port, MessageType type, bool raw, int max_loans)
    : port_(std::move(port)),
      type_(std::move(type)),
      raw_(raw),
      max_loans_(static_cast<std::size_t>(max_loans)) {}

void* FakePublisher::loan() {
  const std::lock_guard lock(mutex_);
  if (lent_.size() >= max_loans_) {
    throw LoanError(
        fmt::format("output '{}': all {} loans are out; publish or drop one before the next (or "
                    "raise max_loans)",
                    port_,
                    max_loans_));
  }
  auto message = make_unclean_message(type_);
  void* const address = message.get();
  lent_[address] = std::move(message);
  return address;
}

std::shared_ptr<void> FakePublisher::take_back(void* message) {
  const auto found = lent_.find(message);
  if (found == lent_.end()) return nullptr;
  auto owned = std::move(found->second);
  lent_.erase(found);
  return owned;
}

void FakePublisher::publish(void* message) {
  const std::lock_guard lock(mutex_);
  auto owned = take_back(message);
  if (!owned) {
    throw std::logic_error(fmt::format("output '{}': published what is not on loan", port_));
  }
  if (!type_.counters_valid(owned.get())) {
    throw std::logic_error(fmt::format(
        "output '{}': a counter of the {} exceeds its list's capacity", port_, type_.ros_name));
  }
  published_.push_back(std::move(owned));
}

void FakePublisher::discard(void* message) noexcept {
  const std::lock_guard lock(mutex_);
  if (take_back(message)) ++discarded_;
}

std::vector<std::shared_ptr<const void>> FakePublisher::published() const {
  const std::lock_guard lock(mutex_);
  return published_;
}

void FakePublisher::forget() {
  const std::lock_guard lock(mutex_);
  published_.clear();
}

std::size_t FakePublisher::outstanding() const {
  const std::lock_guard lock(mutex_);
  return lent_.size();
}

std::size_t FakePublisher::discarded() const {
  const std::lock_guard lock(mutex_);
  return discarded_;
}

FakeSubscription::FakeSubscription(MessageType type,
                                   bool raw,
                                   Context::Callback callback,
                                   SubscribeOptions options)
    : type_(std::move(type)),
      raw_(raw),
      callback_(std::move(callback)),
      options_(std::move(options)) {}

void FakeSubscription::push(std::shared_ptr<void> message, std::int64_t now_ns) {
  if (starved()) ++stats_.starved;
  if (queue_.size() >= static_cast<std::size_t>(options_.qos.depth)) {
    queue_.pop_front();
    ++stats_.lost;
    ++lost_since_delivery_;
  }
  queue_.push_back({std::move(message), {now_ns, ++sent_, 0}});
}

void FakeSubscription::deliver() {
  while (!queue_.empty() && !starved()) {
    auto [message, info] = std::move(queue_.front());
    queue_.pop_front();
    info.lost_before = std::exchange(lost_since_delivery_, 0);
    ++stats_.received;
    ++*held_;
    const void* const address = message.get();
    callback_(std::shared_ptr<const void>(
                  address, [message = std::move(message), held = held_](const void*) { --*held; }),
              info);
  }
}

}  // namespace camvox
