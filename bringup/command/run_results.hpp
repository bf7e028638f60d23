#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace camvox::command {

/// One line of frames.csv (see ResultsComponent).
struct FrameRow {
  std::int64_t stamp_ns = 0;
  std::string state;
  double features = 0.0;
  double with_depth = 0.0;
  double matches = 0.0;
  double inliers = 0.0;
};

/// One line of timing.csv.
struct TimingRow {
  std::string component;
  std::vector<std::string> figures;  ///< frames, median, mean, p95, p99, max in ms.
};

/// Read what `camvox run --out` left. Throw CommandError naming the file.
[[nodiscard]] std::vector<FrameRow> read_frames(const std::filesystem::path& folder);
[[nodiscard]] std::vector<TimingRow> read_timing(const std::filesystem::path& folder);

/// A whole file; throws CommandError.
[[nodiscard]] std::string read_file(const std::filesystem::path& file);

}  // namespace camvox::command
