#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace camvox::bringup {

/// One component class that an installed package offers.
struct PluginEntry {
  std::string class_name;         ///< "camvox::SyncComponent"
  std::string package;            ///< "camvox_components"
  std::filesystem::path library;  ///< Absolute.
};

/// Install prefixes in the order they are searched: AMENT_PREFIX_PATH, CMAKE_PREFIX_PATH, the
/// packages in COLCON_PREFIX_PATH, and the prefix this library is installed in with its siblings,
/// so that nothing needs to be sourced.
[[nodiscard]] std::vector<std::filesystem::path> plugin_prefixes();

/// Every component class in `share/ament_index/resource_index/camvox_components/<package>` of the
/// prefixes; of a package that is in two of them, the first counts.
[[nodiscard]] std::vector<PluginEntry> find_plugins(
    const std::vector<std::filesystem::path>& prefixes = plugin_prefixes());

}  // namespace camvox::bringup
