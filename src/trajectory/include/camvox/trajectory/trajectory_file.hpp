#pragma once

#include <filesystem>

#include "camvox/storage/status.hpp"
#include "camvox/trajectory/trajectory.hpp"

namespace camvox::trajectory {

/// Reads "stamp_s x y z qx qy qz qw" a line, as the TUM RGB-D tools write it; '#' begins a comment.
/// Stamps keep their nanoseconds. Of lines with one stamp (TUM's own files have such) the first
/// counts. The error names file and line: wrong number of columns, not a number, not a unit
/// quaternion, stamps that go back.
[[nodiscard]] storage::Result<Trajectory> read_tum(const std::filesystem::path& file);

/// Writes whole or not at all: into a file beside it, which then takes its name.
[[nodiscard]] storage::Status write_tum(const std::filesystem::path& file,
                                        const Trajectory& trajectory);

/// Reads the upper three rows of a 4x4 matrix a line, as KITTI odometry has it. There are no
/// stamps: line k gets k times `period_ns`.
[[nodiscard]] storage::Result<Trajectory> read_kitti(const std::filesystem::path& file,
                                                     std::int64_t period_ns = 100'000'000);
[[nodiscard]] storage::Status write_kitti(const std::filesystem::path& file,
                                          const Trajectory& trajectory);

/// Either of the two, told apart by the number of columns.
[[nodiscard]] storage::Result<Trajectory> read_trajectory(const std::filesystem::path& file);

}  // namespace camvox::trajectory
