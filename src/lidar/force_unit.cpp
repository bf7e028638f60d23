#include "camvox/lidar/force_unit.hpp"

#include <cmath>

namespace camvox::lidar {

void ForceUnit::add(double force_norm) {
  if (factor_ || !std::isfinite(force_norm)) return;
  sum_ += force_norm;
  if (++count_ < kSamples) return;
  constexpr double kGravity_m_s2 = 9.80665;
  const double mean = sum_ / count_;
  if (mean > 0.5 && mean < 2.0) factor_ = kGravity_m_s2;
  if (mean > 5.0 && mean < 20.0) factor_ = 1.0;
  implausible_ = !factor_;
  count_ = 0;
  sum_ = 0.0;
}

}  // namespace camvox::lidar
