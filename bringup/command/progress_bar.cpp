#include "progress_bar.hpp"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
constexpr auto kTerminalPeriod = 100ms;
constexpr auto kLogPeriod = 5s;
constexpr int kMaxBar = 50;

int terminal_width() {
  winsize size{};
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Seconds as "1:05" or "2:01:05".
std::string clock_text(double seconds) {
  const auto whole = static_cast<long>(seconds + 0.5);
  if (whole < 3600) return fmt::format("{}:{:02}", whole / 60, whole % 60);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

}  // namespace

std::string bar_text(double part, int width) {
  const int inner = std::max(width - 2, 0);
  const int full = static_cast<int>(std::clamp(part, 0.0, 1.0) * inner);
  std::string text(static_cast<std::size_t>(full), '=');
  text.resize(static_cast<std::size_t>(inner), ' ');
  if (full < inner) text[static_cast<std::size_t>(full)] = '>';
  return "[" + text + "]";
}

ProgressBar::ProgressBar(std::string title)
    : title_(std::move(title)), terminal_(isatty(STDERR_FILENO) == 1) {}

ProgressBar::~ProgressBar() {
  if (terminal_ && drawn_) std::fputs("\r\033[K", stderr);
}

void ProgressBar::update(std::uint64_t done, std::uint64_t total) {
  const auto now = Clock::now();
  if (now - last_ < (terminal_ ? Clock::duration(kTerminalPeriod) : Clock::duration(kLogPeriod))) {
    return;
  }
  last_ = now;
  const double part = total == 0 ? 0.0 : static_cast<double>(done) / static_cast<double>(total);
  draw(std::min(part, 1.0), now - begin_);
  drawn_ = true;
}

void ProgressBar::draw(double part, std::chrono::duration<double> elapsed) const {
  const auto left_s = part > 0.0 ? elapsed.count() * (1.0 - part) / part : 0.0;
  const auto numbers = fmt::format(" {:3.0f} %  {} left", 100.0 * part, clock_text(left_s));
  if (!terminal_) {
    fmt::print(stderr, "{}:{}\n", title_, numbers);
    return;
  }
  const int space = terminal_width() - static_cast<int>(title_.size() + numbers.size()) - 2;
  const auto bar = space >= 4 ? " " + bar_text(part, std::min(space, kMaxBar)) : std::string();
  fmt::print(stderr, "\r\033[K{}{}{}", title_, bar, numbers);
  std::fflush(stderr);
}

}  // namespace camvox::command
