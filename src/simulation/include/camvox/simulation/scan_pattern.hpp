#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace camvox::simulation {

/// Where a Livox Horizon points at each shot. Three turning prisms: a fast pair that runs against
/// each other sweeps the beams along a flat ellipse, a slow one carries that ellipse around a
/// larger one, and the speeds have no common multiple, so the pattern never repeats and the
/// field of view, 81.7 x 25.1 degrees, fills up with time. Six lasers stand in a row above
/// each other and fire in turn.
///
/// Amplitudes and rates were measured from a real frame (least squares on 100 ms of a Horizon:
/// fast 28 degrees at 131 Hz, slow 12 x 10 degrees at 13 Hz, lines 0.91 degrees apart).
class HorizonPattern {
 public:
  /// Azimuth (left positive) and elevation (up positive) of a shot, radians.
  struct Direction {
    double azimuth_rad;
    double elevation_rad;
  };

  /// `shot` counts from the start of the recording; `shot_interval_ns` apart.
  [[nodiscard]] static Direction direction(std::int64_t shot,
                                           std::int64_t shot_interval_ns,
                                           int lines);

  /// Unit vector in the lidar frame (x forward, y left, z up).
  [[nodiscard]] static Eigen::Vector3d bearing(const Direction& direction);
};

}  // namespace camvox::simulation
