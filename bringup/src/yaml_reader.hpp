#pragma once

#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"

namespace camvox::bringup {

/// The text of a file; nothing, and the reason among `problems`, when it cannot be read.
std::optional<std::string> read_text(const std::filesystem::path& file,
                                     std::vector<config::Problem>& problems);

/// Turns YAML into typed values and collects what is wrong, with lines.
class YamlReader {
 public:
  YamlReader(std::string origin, std::vector<config::Problem>& problems)
      : origin_(std::move(origin)), problems_(problems) {}

  using Entry = std::function<void(const std::string& key, const YAML::Node& value, int line)>;

  /// Calls back for each entry of a map; reports a node that is no map, keys that are no text, and
  /// duplicate keys. An empty node counts as an empty map.
  void for_each_entry(const YAML::Node& map, const std::string& path, const Entry& entry);
  /// The values of a map with nested maps as dotted keys. `path` goes before keys in messages.
  config::ParameterMap parameters(const YAML::Node& map, const std::string& path);
  /// The value of a scalar or a homogeneous list; reports others.
  std::optional<config::Value> value(const YAML::Node& node, const std::string& path);

  [[nodiscard]] config::Location location(const YAML::Node& node) const;
  void report(const YAML::Node& node, const std::string& path, std::string message);

 private:
  void add_parameters(const YAML::Node& map,
                      const std::string& path,
                      const std::string& prefix,
                      config::ParameterMap& parameters);
  std::optional<config::Value> scalar(const YAML::Node& node, const std::string& path);
  std::optional<config::Value> list(const YAML::Node& node, const std::string& path);

  std::string origin_;
  std::vector<config::Problem>& problems_;
};

}  // namespace camvox::bringup
