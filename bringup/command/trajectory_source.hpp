#pragma once

#include <filesystem>
#include <string>

#include "camvox/trajectory/trajectory.hpp"

namespace camvox::command {

/// A trajectory from a TUM or KITTI file, or from a topic of a bag: Odometry, PoseStamped, or
/// NavSatFix as east, north, up. Without a topic: the first one with "truth" in its name, then the
/// first that fits. Throws CommandError.
[[nodiscard]] trajectory::Trajectory load_trajectory(const std::filesystem::path& path,
                                                     const std::string& topic = {});

}  // namespace camvox::command
