#include "camvox/bringup/plugin_loader.hpp"

#include <console_bridge/console.h>
#include <fmt/format.h>

#include <algorithm>
#include <class_loader/class_loader.hpp>

#include "camvox/config/parameters.hpp"

namespace camvox::bringup {
namespace {

std::string join(const std::vector<std::string>& names) {
  return names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "));
}

/// class_loader wraps the dynamic linker's message in advice; only the message is of use.
std::string linker_message(const std::string& text) {
  static constexpr std::string_view kMarker = "dlopen error: ";
  const auto marker = text.find(kMarker);
  if (marker == std::string::npos) return text;
  const auto start = marker + kMarker.size();
  return text.substr(start, text.find(", at ", start) - start);
}

}  // namespace

PluginLoader::PluginLoader(std::vector<PluginEntry> plugins) : plugins_(std::move(plugins)) {
  console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_NONE);  // all is thrown as well
}

PluginLoader::~PluginLoader() = default;

const PluginEntry& PluginLoader::find(const std::string& class_name) const {
  std::vector<std::string> known;
  for (const auto& plugin : plugins_) {
    if (plugin.class_name == class_name) return plugin;
    known.push_back(plugin.class_name);
  }
  if (known.empty()) {
    throw PluginError(fmt::format(
        "no installed package offers '{}', or any component; build the workspace, or add the "
        "install prefix to AMENT_PREFIX_PATH",
        class_name));
  }
  const auto nearest = config::nearest_name(class_name, known);
  throw PluginError(
      fmt::format("no installed package offers '{}'{}; 'camvox component types' lists "
                  "what there is",
                  class_name,
                  nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
}

class_loader::ClassLoader& PluginLoader::library_of(const PluginEntry& plugin) {
  auto& library = libraries_[plugin.library];
  if (library != nullptr) return *library;
  const auto blame = [&plugin](const std::string& reason) {
    return PluginError(fmt::format(
        "plugin library {} of package {} {}", plugin.library.string(), plugin.package, reason));
  };
  if (!std::filesystem::exists(plugin.library)) {
    throw blame("does not exist; build and install the package again");
  }
  try {
    library = std::make_unique<class_loader::ClassLoader>(plugin.library, false);
  } catch (const std::exception& error) {
    throw blame("cannot be loaded: " + linker_message(error.what()));
  } catch (...) {
    throw blame("cannot be loaded: a static initialiser threw an exception of unknown type");
  }
  return *library;
}

std::shared_ptr<ComponentFactory> PluginLoader::factory(const std::string& class_name) {
  const std::lock_guard lock(mutex_);
  const PluginEntry& plugin = find(class_name);
  auto& library = library_of(plugin);
  const auto available = library.getAvailableClasses<ComponentFactory>();
  const std::string registered = "camvox::ComponentFactoryTemplate<" + class_name + ">";
  if (std::find(available.begin(), available.end(), registered) == available.end()) {
    throw PluginError(fmt::format(
        "plugin library {} does not export '{}'; it exports {} (CAMVOX_REGISTER_COMPONENT and "
        "camvox_register_components must spell the class the same)",
        plugin.library.string(),
        class_name,
        join(available)));
  }
  return library.createInstance<ComponentFactory>(registered);
}

std::string describe(const std::exception_ptr& error) {
  if (error == nullptr) return "no error";
  try {
    std::rethrow_exception(error);
  } catch (const std::exception& known) {
    return known.what();
  } catch (...) {
    return "exception of a type that is not derived from std::exception";
  }
}

}  // namespace camvox::bringup
