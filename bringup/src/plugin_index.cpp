#include "camvox/bringup/plugin_index.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <set>

namespace camvox::bringup {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIndexFolder = "share/ament_index/resource_index/camvox_components";

std::vector<fs::path> paths_in(const char* variable) {
  std::vector<fs::path> paths;
  const char* value = std::getenv(variable);
  std::string text = value != nullptr ? value : "";
  while (!text.empty()) {
    const auto colon = text.find(':');
    if (const auto path = text.substr(0, colon); !path.empty()) paths.emplace_back(path);
    text = colon == std::string::npos ? "" : text.substr(colon + 1);
  }
  return paths;
}

std::vector<fs::path> folders_in(const fs::path& parent) {
  std::vector<fs::path> folders;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(parent, ignored)) {
    if (entry.is_directory(ignored)) folders.push_back(entry.path());
  }
  std::sort(folders.begin(), folders.end());
  return folders;
}

/// The install prefix of this library: <prefix>/lib/libcamvox_configuration.so.
fs::path own_prefix() {
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&own_prefix), &info) == 0) return {};
  std::error_code ignored;
  return fs::weakly_canonical(info.dli_fname, ignored).parent_path().parent_path();
}

void read_index_file(const fs::path& file,
                     const fs::path& prefix,
                     std::vector<PluginEntry>& found) {
  std::ifstream stream(file);
  for (std::string line; std::getline(stream, line);) {
    const auto semicolon = line.find(';');
    if (semicolon == std::string::npos) continue;  // blank, or not for us
    found.push_back(
        {line.substr(0, semicolon), file.filename(), prefix / line.substr(semicolon + 1)});
  }
}

}  // namespace

std::vector<fs::path> plugin_prefixes() {
  std::vector<fs::path> candidates;
  const auto add = [&candidates](const std::vector<fs::path>& paths) {
    candidates.insert(candidates.end(), paths.begin(), paths.end());
  };
  add(paths_in("AMENT_PREFIX_PATH"));
  add(paths_in("CMAKE_PREFIX_PATH"));
  for (const auto& workspace : paths_in("COLCON_PREFIX_PATH")) {
    add({workspace});
    add(folders_in(workspace));
  }
  const fs::path own = own_prefix();
  add({own});
  add(folders_in(own.parent_path()));  // colcon's prefix per package

  std::vector<fs::path> prefixes;
  std::set<fs::path> seen;
  std::error_code ignored;
  for (const auto& candidate : candidates) {
    if (!fs::is_directory(candidate / kIndexFolder, ignored)) continue;
    if (seen.insert(fs::weakly_canonical(candidate, ignored)).second) prefixes.push_back(candidate);
  }
  return prefixes;
}

std::vector<PluginEntry> find_plugins(const std::vector<fs::path>& prefixes) {
  std::vector<PluginEntry> plugins;
  std::set<std::string> packages;
  for (const auto& prefix : prefixes) {
    std::vector<fs::path> files;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(prefix / kIndexFolder, ignored)) {
      files.push_back(entry.path());
    }
    std::sort(files.begin(), files.end());
    for (const auto& file : files) {
      if (packages.insert(file.filename()).second) read_index_file(file, prefix, plugins);
    }
  }
  return plugins;
}

}  // namespace camvox::bringup
