#pragma once

#include <cstdint>

#include "camvox/config/parameters.hpp"

namespace camvox::sensors {

/// What a Livox-type lidar can do: rate, range, noise, beam. Defaults are the Horizon's user
/// manual (range precision 2 cm, angular 0.05 degrees, 260 m at 80 % and 90 m at 10 %
/// reflectivity, beam 0.28 x 0.03 degrees).
struct LidarModel {
  std::int64_t point_interval_ns = 4167;  ///< Time between two shots.
  int lines = 6;                          ///< Lasers fired in turn; shot k is of line k mod lines.
  double min_range_m = 0.5;               ///< Nearer surfaces give no return.
  double max_range_m = 260.0;             ///< Range at reference_reflectivity, facing the beam.
  double reference_reflectivity = 0.8;    ///< Reflectivity at which max_range_m holds.
  double range_sigma_m = 0.02;            ///< White noise of the range.
  double angle_sigma_deg = 0.05;          ///< White noise of the direction, each way.
  double beam_width_deg = 0.03;           ///< Divergence across the lines' row (horizontal).
  double beam_height_deg = 0.28;          ///< Divergence along it (vertical).
  double pulse_length_m = 0.5;            ///< Surfaces nearer than this in range merge into one.
  double drop_probability = 0.002;        ///< Shots lost for no reason.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("point_interval_ns", self.point_interval_ns, config::at_least(1));
    field("lines", self.lines, config::at_least(1), config::at_most(6));
    field("min_range_m", self.min_range_m, config::at_least(0.0));
    field("max_range_m", self.max_range_m, config::greater_than(0.0), config::at_most(1000.0));
    field("reference_reflectivity",
          self.reference_reflectivity,
          config::greater_than(0.0),
          config::at_most(1.0));
    field("range_sigma_m", self.range_sigma_m, config::at_least(0.0), config::at_most(1.0));
    field("angle_sigma_deg", self.angle_sigma_deg, config::at_least(0.0), config::at_most(5.0));
    field("beam_width_deg", self.beam_width_deg, config::at_least(0.0), config::at_most(5.0));
    field("beam_height_deg", self.beam_height_deg, config::at_least(0.0), config::at_most(5.0));
    field("pulse_length_m", self.pulse_length_m, config::at_least(0.0), config::at_most(10.0));
    field("drop_probability", self.drop_probability, config::at_least(0.0), config::at_most(1.0));
  }
};

}  // namespace camvox::sensors
