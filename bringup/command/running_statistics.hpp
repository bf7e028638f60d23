#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <deque>
#include <numeric>

namespace camvox::command {

/// The last `capacity` numbers, and what they amount to.
class Window {
 public:
  explicit Window(std::size_t capacity) : capacity_(capacity) {}

  void add(double number) {
    numbers_.push_back(number);
    if (numbers_.size() > capacity_) numbers_.pop_front();
  }
  [[nodiscard]] bool empty() const { return numbers_.empty(); }
  [[nodiscard]] std::size_t size() const { return numbers_.size(); }
  [[nodiscard]] double sum() const {
    return std::accumulate(numbers_.begin(), numbers_.end(), 0.0);
  }
  [[nodiscard]] double mean() const { return sum() / static_cast<double>(size()); }
  [[nodiscard]] double min() const { return *std::min_element(numbers_.begin(), numbers_.end()); }
  [[nodiscard]] double max() const { return *std::max_element(numbers_.begin(), numbers_.end()); }
  [[nodiscard]] double front() const { return numbers_.front(); }
  [[nodiscard]] double back() const { return numbers_.back(); }
  [[nodiscard]] double standard_deviation() const {
    double squares = 0.0;
    for (const double number : numbers_) squares += (number - mean()) * (number - mean());
    return std::sqrt(squares / static_cast<double>(size()));
  }

 private:
  std::size_t capacity_;
  std::deque<double> numbers_;
};

}  // namespace camvox::command
