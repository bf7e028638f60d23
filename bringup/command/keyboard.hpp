#pragma once

#include <termios.h>

#include <functional>
#include <thread>

#include "signals.hpp"

namespace camvox::command {

enum class Key { kSpace, kRight, kUp, kDown, kOther };

/// Calls back for each key that is pressed, on a thread of its own. Does nothing if standard input
/// is no terminal. The terminal is as before when this is destroyed.
class Keyboard {
 public:
  explicit Keyboard(std::function<void(Key)> on_key);
  Keyboard(const Keyboard&) = delete;
  Keyboard& operator=(const Keyboard&) = delete;
  ~Keyboard();
  [[nodiscard]] bool active() const { return active_; }

 private:
  void read();

  std::function<void(Key)> on_key_;
  bool active_;
  termios saved_{};
  Event stop_;
  std::thread thread_;
};

}  // namespace camvox::command
