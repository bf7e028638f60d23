#pragma once

#include <chrono>
#include <thread>

namespace camvox::test {

/// Waits until the condition holds; false if it does not within the time. Generous on purpose: it
/// only ever runs out when something is broken.
template <typename Condition>
[[nodiscard]] bool wait_until(Condition&& holds,
                              std::chrono::milliseconds patience = std::chrono::seconds(30)) {
  const auto deadline = std::chrono::steady_clock::now() + patience;
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace camvox::test
