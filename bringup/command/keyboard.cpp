#include "keyboard.hpp"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <string_view>

namespace camvox::command {
namespace {

Key parse_key(std::string_view bytes) {
  if (bytes == " ") return Key::kSpace;
  if (bytes == "\x1b[C") return Key::kRight;
  if (bytes == "\x1b[A") return Key::kUp;
  if (bytes == "\x1b[B") return Key::kDown;
  return Key::kOther;
}

}  // namespace

Keyboard::Keyboard(std::function<void(Key)> on_key)
    : on_key_(std::move(on_key)), active_(isatty(STDIN_FILENO) == 1) {
  if (!active_) return;
  tcgetattr(STDIN_FILENO, &saved_);
  termios raw = saved_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);  // keys at once; Ctrl-C still works
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  thread_ = std::thread([this] { read(); });
}

Keyboard::~Keyboard() {
  if (!active_) return;
  stop_.set();
  thread_.join();
  tcsetattr(STDIN_FILENO, TCSANOW, &saved_);
}

void Keyboard::read() {
  std::array<pollfd, 2> files = {pollfd{STDIN_FILENO, POLLIN, 0}, pollfd{stop_.fd(), POLLIN, 0}};
  std::array<char, 16> bytes{};
  for (;;) {
    if (poll(files.data(), files.size(), -1) < 0) continue;
    if (files[1].revents != 0) return;
    const auto count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (count <= 0) return;
    on_key_(parse_key({bytes.data(), static_cast<std::size_t>(count)}));
  }
}

}  // namespace camvox::command
