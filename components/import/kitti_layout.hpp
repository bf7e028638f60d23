#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "camvox/import/import_report.hpp"

namespace camvox::import {

/// The folders of one drive.
struct KittiFolders {
  std::filesystem::path calibration;
  std::filesystem::path drive;
};

/// Finds them from the folder of the date or of the drive; an error if it is neither, or if the
/// date has several drives and `drive` does not say which.
[[nodiscard]] KittiFolders find_kitti_folders(const std::filesystem::path& folder,
                                              const std::string& drive);

/// One data file of a sensor with its time.
struct KittiFrame {
  std::size_t number = 0;  ///< Line in timestamps.txt, from 0.
  std::int64_t stamp_ns = 0;
  std::filesystem::path file;
};

/// The frames of a sensor folder that have a time stamp and a file with one of the extensions
/// (".bin"), the first that exists. What has only one of both is reported; so is a missing folder.
[[nodiscard]] std::vector<KittiFrame> list_kitti_frames(const std::filesystem::path& sensor,
                                                        const std::vector<std::string>& extensions,
                                                        ImportReport& report);

/// Time stamps of a file, "2011-09-26 13:10:51.168593664" read as UTC, one a line; none for a blank
/// line.
[[nodiscard]] std::vector<std::optional<std::int64_t>> read_kitti_stamps(
    const std::filesystem::path& path);

}  // namespace camvox::import
