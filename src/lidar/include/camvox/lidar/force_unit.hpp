#pragma once

#include <cstdint>
#include <optional>

namespace camvox::lidar {

/// Finds out whether an accelerometer reports m/s^2, as ROS demands, or g, as the IMU inside of a
/// Livox lidar does. The mean of the specific force's norm over a second is near 9.8 or near 1 for
/// any robot; the decision is made once, and again only if the sensor is restarted.
class ForceUnit {
 public:
  /// Takes a norm as reported. Call for every sample.
  void add(double force_norm);

  /// Factor to m/s^2; nothing while undecided, or when it is neither unit.
  [[nodiscard]] std::optional<double> factor_m_s2() const { return factor_; }
  /// True when enough samples say that it is neither: no gravity, or broken.
  [[nodiscard]] bool implausible() const { return implausible_; }

 private:
  static constexpr int kSamples = 20;
  int count_ = 0;
  double sum_ = 0.0;
  std::optional<double> factor_;
  bool implausible_ = false;
};

}  // namespace camvox::lidar
