#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "camvox/storage/bag_reader.hpp"

namespace camvox::recording {

struct PlayerOptions {
  double rate = 1.0;  ///< Speed: 2 plays twice as fast as it was recorded.
  bool as_fast_as_possible = false;
  bool loop = false;
  double start_offset_s = 0.0;  ///< Starts this long after the bag's first message.
  double duration_s = std::numeric_limits<double>::infinity();
  bool start_paused = false;
  std::vector<std::string> topics;                        ///< Empty: all.
  std::size_t read_ahead_bytes = std::size_t{256} << 20;  ///< Bound of what waits in memory.
  std::size_t read_ahead_messages = 0;                    ///< The same, in messages; 0: no bound.
};

/// One message of the bag, ready to be sent.
struct PlayedMessage {
  std::size_t topic = 0;  ///< Number in BagReader::topics.
  std::int64_t log_time_ns = 0;
  std::vector<std::uint8_t> cdr;
};

/// How far playing is.
struct PlayerState {
  std::int64_t position_ns = 0;  ///< Log time of the last message sent.
  std::uint64_t sent = 0;
  std::uint64_t refused = 0;  ///< Could not be sent: `publish` threw.
  std::string refusal;        ///< Why the first of those.
  double rate = 1.0;
  bool paused = false;
  bool finished = false;
  storage::Status status;  ///< Why reading ended early, if it did.
};

/// Plays a bag in the order of its log times. One thread reads ahead, another sends each message
/// when its time has come; `publish` is called on that thread, and what it throws costs only that
/// message. `gate` may hold a message back (for lockstep): it is asked before each message, and
/// again whenever `poke` was called.
class Player {
 public:
  using Publish = std::function<void(PlayedMessage&& message)>;
  using Gate = std::function<bool(const PlayedMessage& message)>;

  Player(std::unique_ptr<storage::BagReader> bag,
         PlayerOptions options,
         Publish publish,
         Gate gate = {});
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;
  ~Player();

  void start();
  void stop();
  void set_paused(bool paused);
  void toggle_paused();
  /// Sends the next message although paused.
  void play_next();
  /// Ignored unless positive.
  void set_rate(double rate);
  void poke();

  [[nodiscard]] PlayerState state() const;
  [[nodiscard]] const storage::BagReader& bag() const { return *bag_; }
  /// Log time that corresponds to now; it stands still while paused.
  [[nodiscard]] std::int64_t clock_ns() const;
  /// Blocks until the end of the bag or stop().
  void wait_until_finished();

 private:
  using SteadyTime = std::chrono::steady_clock::time_point;

  void read_ahead();
  bool read_pass();
  void push(PlayedMessage message);
  template <typename Body>
  void guard(Body&& body);
  void play();
  void play_all();
  std::string try_publish(PlayedMessage&& message);
  bool hold(std::unique_lock<std::mutex>& lock, const PlayedMessage& message);
  std::optional<PlayedMessage> next_due(std::unique_lock<std::mutex>& lock);
  [[nodiscard]] SteadyTime due_time(std::int64_t log_time_ns) const;
  void restart_clock(std::int64_t log_time_ns);
  [[nodiscard]] std::int64_t clock_locked() const;

  std::unique_ptr<storage::BagReader> bag_;
  PlayerOptions options_;
  Publish publish_;
  Gate gate_;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<PlayedMessage> queue_;
  std::size_t queued_bytes_ = 0;
  bool read_all_ = false;
  bool stopping_ = false;
  bool step_ = false;
  std::uint64_t pokes_ = 0;
  PlayerState state_;
  // The clock: log time `clock_origin_ns_` was, or will be, at `clock_start_`.
  std::int64_t clock_origin_ns_ = 0;
  SteadyTime clock_start_;
  bool clock_runs_ = false;

  std::thread reader_;
  std::thread player_;
};

}  // namespace camvox::recording
