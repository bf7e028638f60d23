#include "signals.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <system_error>

#include "command.hpp"

namespace camvox::command {
namespace {

constexpr std::chrono::seconds kSameRequest{1};  // signals so close together ask for the same

sigset_t stop_signals() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGINT);
  sigaddset(&set, SIGTERM);
  return set;
}

int checked(int fd) {
  if (fd < 0) throw std::system_error(errno, std::generic_category(), "no file descriptor");
  return fd;
}

int to_poll_timeout(std::optional<std::chrono::milliseconds> timeout) {
  return timeout ? static_cast<int>(timeout->count()) : -1;
}

/// The index of the first descriptor that became readable, or -1 after the timeout.
int wait_for(int first, int second, std::optional<std::chrono::milliseconds> timeout) {
  pollfd waiting[] = {{first, POLLIN, 0}, {second, POLLIN, 0}};
  while (poll(waiting, 2, to_poll_timeout(timeout)) < 0 && errno == EINTR) {
  }
  if (waiting[0].revents != 0) return 0;
  return waiting[1].revents != 0 ? 1 : -1;
}

}  // namespace

void block_stop_signals() {
  const sigset_t set = stop_signals();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
}

Event::Event() : fd_(checked(eventfd(0, EFD_CLOEXEC))) {}
Event::~Event() { close(fd_); }
void Event::set() { eventfd_write(fd_, 1); }

StopSignal::StopSignal() {
  const sigset_t set = stop_signals();
  signals_ = checked(signalfd(-1, &set, SFD_CLOEXEC));
}

StopSignal::~StopSignal() { close(signals_); }

bool StopSignal::wait(std::optional<std::chrono::milliseconds> timeout) {
  const int ready = wait_for(signals_, requested_.fd(), timeout);
  if (ready == 0) {
    signalfd_siginfo info{};
    [[maybe_unused]] const auto bytes = read(signals_, &info, sizeof(info));
  }
  return ready >= 0;
}

ExitGuard::ExitGuard(std::chrono::milliseconds patience,
                     std::function<void()> on_overdue,
                     std::function<void(const char*)> tell)
    : patience_(patience),
      on_overdue_(std::move(on_overdue)),
      tell_(std::move(tell)),
      thread_([this] { watch(); }) {}

ExitGuard::~ExitGuard() {
  over_.set();
  signal_.request();
  thread_.join();
}

void ExitGuard::extend(std::chrono::milliseconds patience) {
  deadline_ = std::max(deadline_.load(), std::chrono::steady_clock::now() + patience);
}

void ExitGuard::wait() { wait_for(asked_.fd(), over_.fd(), {}); }

void ExitGuard::watch() {
  signal_.wait();
  if (wait_for(over_.fd(), -1, std::chrono::milliseconds(0)) == 0) return;
  const auto first = std::chrono::steady_clock::now();
  asked_.set();
  extend(patience_);
  tell_("ends; a second Ctrl-C ends without saving");
  while (std::chrono::steady_clock::now() < deadline_.load()) {
    if (signal_.wait(std::chrono::milliseconds(20))) {
      if (wait_for(over_.fd(), -1, std::chrono::milliseconds(0)) == 0) return;
      if (std::chrono::steady_clock::now() - first < kSameRequest) continue;
      tell_("ends without saving: asked for twice");
      std::_Exit(Exit::kInterrupted);
    }
  }
  on_overdue_();
  std::_Exit(Exit::kUnclean);
}

}  // namespace camvox::command
