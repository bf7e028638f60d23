#pragma once

#include "camvox/import/import_report.hpp"

namespace camvox::import {

/// What a file without times, lines and tags leaves open. The defaults are a Livox Horizon's.
struct LivoxCsvOptions : ImportOptions {
  std::string topic = "/livox/lidar";
  std::int64_t start_ns = 0;              ///< Time of the first row; Livox counts from power-on.
  std::int64_t point_interval_ns = 4167;  ///< 240 000 points/s.
  int lines = 6;                          ///< Lasers that fire in turn: line = row modulo this.
  std::int64_t message_ns = 100'000'000;  ///< Time that one message spans.
};

/// Imports points of a Livox lidar in firing order as livox_ros_driver2/msg/CustomMsg.
///
/// A row is x, y, z in metres and intensity (0 to 255). A first row of names may add and reorder
/// columns: x, y, z, intensity or reflectivity, offset_time (ns after `start_ns`, ascending), tag,
/// line. A row (0, 0, 0) is a shot that did not come back: it takes its time and is left out.
storage::Result<ImportReport> import_livox_csv(const std::filesystem::path& file,
                                               const LivoxCsvOptions& options);

}  // namespace camvox::import
