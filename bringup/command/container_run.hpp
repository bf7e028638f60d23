#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "camvox/bringup/container.hpp"

namespace camvox::command {

/// The file, or the one of that name among the installed configs.
[[nodiscard]] std::filesystem::path find_config(const std::string& name);

/// Prints the problems of a config and throws CommandError.
[[noreturn]] void refuse(const std::vector<bringup::Problem>& problems);

/// What probe_system gave for a config, without problems.
struct CheckedConfig {
  bringup::SystemConfig config;
  bringup::ProbedSystem probed;
};

/// Runs a container until a signal comes or a component asks for the end. Returns an exit code; a
/// container that hangs ends the process.
[[nodiscard]] int run_container(CheckedConfig checked,
                                std::shared_ptr<bringup::PluginLoader> plugins,
                                const bringup::LoggerFactory& loggers);

}  // namespace camvox::command
