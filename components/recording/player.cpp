#include "camvox/recording/player.hpp"

#include <pthread.h>

#include <chrono>
#include <cmath>
#include <utility>

namespace camvox::recording {
namespace {

using Clock = std::chrono::steady_clock;

std::int64_t to_ns(double seconds) {
  constexpr double kLongest_s = 4e9;  // int64 nanoseconds end at 9e9 s
  return static_cast<std::int64_t>(std::min(seconds, kLongest_s) * 1e9);
}

}  // namespace

Player::Player(std::unique_ptr<storage::BagReader> bag,
               PlayerOptions options,
               Publish publish,
               Gate gate)
    : bag_(std::move(bag)),
      options_(std::move(options)),
      publish_(std::move(publish)),
      gate_(std::move(gate)) {
  state_.rate = options_.rate;
  state_.paused = options_.start_paused;
  state_.position_ns = bag_->start_time_ns() + to_ns(options_.start_offset_s);
  clock_origin_ns_ = state_.position_ns;
}

Player::~Player() { stop(); }

void Player::start() {
  reader_ = std::thread([this] { read_ahead(); });
  player_ = std::thread([this] { play(); });
  pthread_setname_np(reader_.native_handle(), "bag-reader");
  pthread_setname_np(player_.native_handle(), "bag-player");
}

void Player::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  if (reader_.joinable()) reader_.join();
  if (player_.joinable()) player_.join();
}

void Player::set_paused(bool paused) {
  {
    const std::lock_guard lock(mutex_);
    const std::int64_t now_ns = clock_locked();
    state_.paused = paused;
    restart_clock(now_ns);
  }
  changed_.notify_all();
}

void Player::toggle_paused() { set_paused(!state().paused); }

void Player::play_next() {
  {
    const std::lock_guard lock(mutex_);
    step_ = true;
  }
  changed_.notify_all();
}

void Player::set_rate(double rate) {
  if (!(rate > 0.0) || !std::isfinite(rate)) return;
  {
    const std::lock_guard lock(mutex_);
    const std::int64_t now_ns = clock_locked();
    state_.rate = rate;
    restart_clock(now_ns);
  }
  changed_.notify_all();
}

void Player::poke() {
  {
    const std::lock_guard lock(mutex_);
    ++pokes_;
  }
  changed_.notify_all();
}

PlayerState Player::state() const {
  const std::lock_guard lock(mutex_);
  return state_;
}

std::int64_t Player::clock_ns() const {
  const std::lock_guard lock(mutex_);
  return clock_locked();
}

void Player::wait_until_finished() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return state_.finished || stopping_; });
}

std::int64_t Player::clock_locked() const {
  if (!clock_runs_ || state_.paused) return clock_origin_ns_;
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - clock_start_).count();
  return clock_origin_ns_ + to_ns(elapsed_s * state_.rate);
}

void Player::restart_clock(std::int64_t log_time_ns) {
  clock_origin_ns_ = log_time_ns;
  clock_start_ = Clock::now();
}

Player::SteadyTime Player::due_time(std::int64_t log_time_ns) const {
  const double ahead_s = static_cast<double>(log_time_ns - clock_origin_ns_) * 1e-9 / state_.rate;
  return clock_start_ +
         std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(ahead_s));
}

void Player::push(PlayedMessage message) {
  std::unique_lock lock(mutex_);
  const std::size_t bytes = message.cdr.size();
  changed_.wait(lock, [&] {
    if (stopping_ || queue_.empty()) return true;
    const auto most = options_.read_ahead_messages;
    return queued_bytes_ + bytes <= options_.read_ahead_bytes &&
           (most == 0 || queue_.size() < most);
  });
  queued_bytes_ += bytes;
  queue_.push_back(std::move(message));
  lock.unlock();
  changed_.notify_all();
}

/// Reads the bag once; false when there was nothing to play in it, or it could not be read.
bool Player::read_pass() {
  storage::MessageFilter filter;
  const std::int64_t start_ns = bag_->start_time_ns() + to_ns(options_.start_offset_s);
  filter.start_time_ns = static_cast<std::uint64_t>(start_ns);
  if (std::isfinite(options_.duration_s)) {
    filter.end_time_ns = static_cast<std::uint64_t>(start_ns + to_ns(options_.duration_s));
  }
  filter.topics = options_.topics;
  auto cursor = bag_->messages(filter);
  bool any = false;
  while (const auto* message = cursor.next()) {
    const auto* data = reinterpret_cast<const std::uint8_t*>(message->data.data());
    push({message->topic, message->log_time_ns, {data, data + message->data.size()}});
    any = true;
    const std::lock_guard lock(mutex_);
    if (stopping_) return false;
  }
  const std::lock_guard lock(mutex_);
  if (state_.status.ok()) state_.status = cursor.status();
  return any && cursor.status().ok();
}

/// Runs the body of a thread. What it throws ends playing, and is told as damage of the bag is.
template <typename Body>
void Player::guard(Body&& body) {
  try {
    body();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    state_.status = {storage::StatusCode::kInvalid,
                     std::string("playing ended early: ") + error.what()};
  }
}

void Player::read_ahead() {
  guard([this] {
    while (read_pass() && options_.loop) {
    }
  });
  {
    const std::lock_guard lock(mutex_);
    read_all_ = true;
  }
  changed_.notify_all();
}

/// False if the message may go as far as gate and pause are concerned; else waits until they may
/// think otherwise.
bool Player::hold(std::unique_lock<std::mutex>& lock, const PlayedMessage& message) {
  if (gate_ && !gate_(message)) {
    changed_.wait(lock, [this, pokes = pokes_] { return stopping_ || pokes_ != pokes; });
    return true;
  }
  if (!state_.paused || step_) return false;
  changed_.wait(lock, [this] { return stopping_ || !state_.paused || step_; });
  return true;
}

/// The next message, once it is due; nothing at the end of the bag.
std::optional<PlayedMessage> Player::next_due(std::unique_lock<std::mutex>& lock) {
  for (;;) {
    changed_.wait(lock, [this] { return stopping_ || read_all_ || !queue_.empty(); });
    if (stopping_ || queue_.empty()) return std::nullopt;
    const PlayedMessage& front = queue_.front();
    if (!clock_runs_ || front.log_time_ns < state_.position_ns) {  // the first, or looped
      clock_runs_ = true;
      restart_clock(front.log_time_ns);
    }
    if (hold(lock, front)) continue;
    const auto due = due_time(front.log_time_ns);
    if (step_ || options_.as_fast_as_possible || Clock::now() >= due) break;
    changed_.wait_until(lock, due);
  }
  step_ = false;
  PlayedMessage message = std::move(queue_.front());
  queue_.pop_front();
  queued_bytes_ -= message.cdr.size();
  return message;
}

/// Why the message could not be sent, or "": one that cannot is no reason to keep back the rest.
std::string Player::try_publish(PlayedMessage&& message) {
  try {
    publish_(std::move(message));
    return {};
  } catch (const std::exception& error) {
    return error.what();
  }
}

void Player::play_all() {
  std::unique_lock lock(mutex_);
  while (auto message = next_due(lock)) {
    state_.position_ns = message->log_time_ns;
    if (state_.paused) restart_clock(message->log_time_ns);
    lock.unlock();
    changed_.notify_all();
    auto problem = try_publish(std::move(*message));
    lock.lock();
    if (problem.empty()) {
      ++state_.sent;
    } else if (state_.refused++ == 0) {
      state_.refusal = std::move(problem);
    }
  }
}

void Player::play() {
  guard([this] { play_all(); });
  {
    const std::lock_guard lock(mutex_);
    state_.finished = true;
  }
  changed_.notify_all();
}

}  // namespace camvox::recording
