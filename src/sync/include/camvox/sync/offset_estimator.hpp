#pragma once

#include <cstddef>
#include <vector>

namespace camvox::sync {

/// Median and spread of the latest values of a noisy quantity, outliers and all: how far apart two
/// sensors' stamps are, or how long messages take.
class OffsetEstimator {
 public:
  struct Estimate {
    double offset_s = 0.0;
    double jitter_s = 0.0;  ///< Standard deviation, from the median absolute deviation.
    std::size_t count = 0;  ///< 0: no estimate.
  };

  explicit OffsetEstimator(std::size_t window = 100) : window_(window) {}

  void add(double value_s);
  [[nodiscard]] Estimate estimate() const;

 private:
  std::size_t window_;
  std::size_t next_ = 0;
  std::vector<double> values_s_;
};

}  // namespace camvox::sync
