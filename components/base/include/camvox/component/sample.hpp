#pragma once

#include <cstdint>
#include <memory>
#include <utility>

namespace camvox {

/// What the middleware knows of one received message.
struct MessageInfo {
  std::int64_t publish_stamp_ns = 0;  ///< When the publisher sent it; wall clock, ns.
  std::uint64_t sequence = 0;         ///< Counts the publisher's messages from 1.
  std::uint64_t lost_before = 0;      ///< Messages of this publisher missed right before this one.
};

/// A received message, read in place: for a plain message in the same container this is the very
/// memory that the publisher filled. Copies share it; it goes back to the middleware with the last
/// copy, on any thread. Holding more than `SubscribeOptions::max_held` of them stops delivery.
template <typename T>
class Sample {
 public:
  Sample(std::shared_ptr<const T> message, MessageInfo info)
      : message_(std::move(message)), info_(info) {}

  const T& operator*() const { return *message_; }
  const T* operator->() const { return message_.get(); }
  [[nodiscard]] const std::shared_ptr<const T>& message() const { return message_; }
  [[nodiscard]] const MessageInfo& info() const { return info_; }

 private:
  std::shared_ptr<const T> message_;
  MessageInfo info_;
};

}  // namespace camvox
