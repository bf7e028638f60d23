#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "camvox/storage/bag_writer.hpp"

namespace camvox::recording {

/// What a recording has done so far.
struct RecorderState {
  std::uint64_t written = 0;
  std::uint64_t written_bytes = 0;
  std::uint64_t dropped = 0;  ///< Refused because the disk was too slow and the cache full.
  storage::Status status;     ///< The first error; nothing is written after it.
};

/// Writes messages to a bag on a thread of its own, so that the disk never holds up who sends
/// them. What waits is bounded by `max_cache_bytes`.
class Recorder {
 public:
  Recorder(std::unique_ptr<storage::BagWriter> bag, std::size_t max_cache_bytes);
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;
  ~Recorder();

  /// Number of the topic for `write`.
  [[nodiscard]] storage::Result<std::size_t> add_topic(storage::BagTopic topic);
  /// Takes a message over; the bytes are kept alive until they are written.
  void write(std::size_t topic,
             std::int64_t log_time_ns,
             std::int64_t publish_time_ns,
             std::shared_ptr<const std::vector<std::uint8_t>> cdr);
  [[nodiscard]] RecorderState state() const;
  /// Writes what waits, and closes the bag.
  storage::Status close();

 private:
  struct Item {
    std::size_t topic;
    std::int64_t log_time_ns;
    std::int64_t publish_time_ns;
    std::shared_ptr<const std::vector<std::uint8_t>> cdr;
  };

  void run();
  void write_item(const Item& item);

  std::size_t max_cache_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Item> queue_;
  std::size_t queued_bytes_ = 0;
  bool closing_ = false;
  RecorderState state_;

  std::mutex bag_mutex_;  // the bag is written by our thread and gets topics from others
  std::unique_ptr<storage::BagWriter> bag_;
  std::thread thread_;
};

}  // namespace camvox::recording
