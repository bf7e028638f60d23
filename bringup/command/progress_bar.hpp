#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace camvox::command {

/// Shows on standard error how far long work is: a bar on a terminal, and a line every few seconds
/// in a log. Work that ends soon leaves nothing in a log.
class ProgressBar {
 public:
  /// `title` says what is done: "import kitti_0013".
  explicit ProgressBar(std::string title);
  /// Wipes the bar: what comes next starts on a clean line.
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// May be called as often as one likes.
  void update(std::uint64_t done, std::uint64_t total);

 private:
  using Clock = std::chrono::steady_clock;
  void draw(double part, std::chrono::duration<double> elapsed) const;

  std::string title_;
  bool terminal_;
  bool drawn_ = false;
  Clock::time_point begin_ = Clock::now();
  Clock::time_point last_ = begin_;
};

/// "[=====>    ]" for a part between 0 and 1; as wide as asked for, at least 2.
[[nodiscard]] std::string bar_text(double part, int width);

}  // namespace camvox::command
