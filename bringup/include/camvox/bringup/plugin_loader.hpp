#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <stdexcept>
#include <string>
#include <vector>

#include "camvox/bringup/plugin_index.hpp"
#include "camvox/component/component.hpp"

namespace class_loader {
class ClassLoader;
}

namespace camvox::bringup {

/// A plugin that cannot be had; `what()` says which, where it was looked for, and what to do.
class PluginError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Makes components by class name. Libraries stay loaded as long as this object lives, which must
/// be longer than every component and the DDS participant (it calls into their type supports).
/// Thread-safe.
class PluginLoader {
 public:
  explicit PluginLoader(std::vector<PluginEntry> plugins = find_plugins());
  PluginLoader(const PluginLoader&) = delete;
  PluginLoader& operator=(const PluginLoader&) = delete;
  ~PluginLoader();

  [[nodiscard]] const std::vector<PluginEntry>& plugins() const { return plugins_; }

  /// Throws PluginError if no package offers the class, its library is missing or does not load,
  /// or the class is not in it.
  [[nodiscard]] std::shared_ptr<ComponentFactory> factory(const std::string& class_name);

 private:
  [[nodiscard]] const PluginEntry& find(const std::string& class_name) const;
  [[nodiscard]] class_loader::ClassLoader& library_of(const PluginEntry& plugin);

  std::vector<PluginEntry> plugins_;
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<class_loader::ClassLoader>> libraries_;
};

/// The text of any exception, std or not: "std::runtime_error: no such file" is "no such file".
[[nodiscard]] std::string describe(const std::exception_ptr& error);

}  // namespace camvox::bringup
