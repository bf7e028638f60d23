#include "camvox/recording/recorder.hpp"

#include <pthread.h>

#include <span>
#include <utility>

namespace camvox::recording {

Recorder::Recorder(std::unique_ptr<storage::BagWriter> bag, std::size_t max_cache_bytes)
    : max_cache_bytes_(max_cache_bytes), bag_(std::move(bag)), thread_([this] { run(); }) {
  pthread_setname_np(thread_.native_handle(), "bag-writer");
}

Recorder::~Recorder() {
  // An error at this point was kept in the state since it happened; close() tells it.
  (void)close();
}

storage::Result<std::size_t> Recorder::add_topic(storage::BagTopic topic) {
  const std::lock_guard lock(bag_mutex_);
  return bag_->add_topic(std::move(topic));
}

void Recorder::write(std::size_t topic,
                     std::int64_t log_time_ns,
                     std::int64_t publish_time_ns,
                     std::shared_ptr<const std::vector<std::uint8_t>> cdr) {
  {
    const std::lock_guard lock(mutex_);
    if (closing_ || !state_.status.ok() || queued_bytes_ + cdr->size() > max_cache_bytes_) {
      ++state_.dropped;
      return;
    }
    queued_bytes_ += cdr->size();
    queue_.push_back({topic, log_time_ns, publish_time_ns, std::move(cdr)});
  }
  changed_.notify_one();
}

RecorderState Recorder::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

void Recorder::write_item(const Item& item) {
  storage::Status status;
  {
    const std::lock_guard lock(bag_mutex_);
    status = bag_->write(
        item.topic, item.log_time_ns, item.publish_time_ns, std::as_bytes(std::span(*item.cdr)));
  }
  const std::lock_guard lock(mutex_);
  queued_bytes_ -= item.cdr->size();
  if (status.ok()) {
    ++state_.written;
    state_.written_bytes += item.cdr->size();
  } else if (state_.status.ok()) {
    state_.status = status;
  }
}

void Recorder::run() {
  for (;;) {
    Item item;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return closing_ || !queue_.empty(); });
      if (queue_.empty()) return;
      item = std::move(queue_.front());
      queue_.pop_front();
    }
    write_item(item);
  }
}

storage::Status Recorder::close() {
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  changed_.notify_one();
  if (thread_.joinable()) thread_.join();
  const std::lock_guard lock(bag_mutex_);
  const storage::Status closed = bag_ ? bag_->close() : storage::Status();
  bag_.reset();
  const std::lock_guard state_lock(mutex_);
  if (state_.status.ok() && !closed.ok()) state_.status = closed;
  return state_.status;
}

}  // namespace camvox::recording
