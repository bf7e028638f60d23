#pragma once

#include <map>
#include <string>

#include "camvox/interfaces/qos.hpp"

namespace camvox::recording {

/// Messages that wait at most, where the file says that all shall be kept.
inline constexpr int kQueuedMessages = 4096;

/// Reads a file of QoS by topic as `ros2 bag` takes it; an empty path: none. Policies that we do
/// not have are left out. Throws std::runtime_error with file and line.
[[nodiscard]] std::map<std::string, interfaces::Qos> read_qos_overrides(const std::string& path);

}  // namespace camvox::recording
