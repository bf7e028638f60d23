#include "camvox/sync/offset_estimator.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::sync {
namespace {

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

}  // namespace

void OffsetEstimator::add(double value_s) {
  if (!std::isfinite(value_s)) return;
  if (values_s_.size() < window_) {
    values_s_.push_back(value_s);
  } else {
    values_s_[next_] = value_s;
  }
  next_ = (next_ + 1) % window_;
}

OffsetEstimator::Estimate OffsetEstimator::estimate() const {
  if (values_s_.empty()) return {};
  std::vector<double> values = values_s_;
  const double offset_s = median(values);
  for (auto& value : values) value = std::abs(value - offset_s);
  constexpr double kSigmaPerDeviation = 1.4826;  // of a normal distribution
  return {offset_s, kSigmaPerDeviation * median(values), values_s_.size()};
}

}  // namespace camvox::sync
