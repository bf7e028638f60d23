#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "camvox/config/parameters.hpp"

/// The config file of a container: what it says, checked and typed.
namespace camvox::bringup {

using config::Location;
using config::ParameterMap;
using config::Problem;

/// Section `container`.
struct ContainerConfig {
  std::string name = "camvox";        ///< First part of the container's service names.
  int domain_id = 0;                  ///< DDS domain; ROS_DOMAIN_ID overrides it.
  std::string network = "localhost";  ///< Who is reached: this machine, or the subnet.
  std::vector<std::string> transports = {"shared_memory", "udp"};  ///< Towards other processes.
  std::vector<std::string> peers;     ///< More hosts to look for, with network: subnet.
  int shared_memory_segment_mb = 64;  ///< Must hold the largest messages in flight.
  std::string log_level = "info";
  std::vector<std::string> external_topics;  ///< Internal topics that another container publishes.
  double diagnostics_period_s = 1.0;
  double watchdog_s = 5.0;       ///< A callback that runs longer is reported; 0: never.
  double save_timeout_s = 60.0;  ///< For components to save their results at the end.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("name", self.name, config::not_empty());
    field("domain_id", self.domain_id, config::at_least(0), config::at_most(232));
    field("network", self.network, config::one_of({"localhost", "subnet"}));
    field("transports",
          self.transports,
          config::not_empty(),
          config::one_of({"shared_memory", "udp"}));
    field("peers", self.peers);
    field("shared_memory_segment_mb",
          self.shared_memory_segment_mb,
          config::at_least(1),
          config::at_most(2047));
    field("log_level", self.log_level, config::one_of({"debug", "info", "warn", "error", "fatal"}));
    field("external_topics", self.external_topics);
    field("diagnostics_period_s",
          self.diagnostics_period_s,
          config::at_least(0.05),
          config::at_most(3600.0));
    field("watchdog_s", self.watchdog_s, config::at_least(0.0), config::at_most(86400.0));
    field("save_timeout_s", self.save_timeout_s, config::at_least(0.0), config::at_most(86400.0));
  }
};

/// One entry of section `topics`.
struct TopicConfig {
  std::string zero_copy = "container";  ///< Shared memory inside the container, or the machine.
  int max_blocking_ms = 50;             ///< Longest time that a publish may wait for readers.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("zero_copy", self.zero_copy, config::one_of({"container", "interprocess"}));
    field("max_blocking_ms", self.max_blocking_ms, config::at_least(0), config::at_most(60000));
  }
};

/// One entry of section `components`.
struct ComponentConfig {
  struct Remap {
    std::string topic;
    Location location;
  };

  std::string plugin;             ///< Class name.
  std::string name;               ///< Unique in the container.
  std::string executor;           ///< Components with the same executor share its thread.
  std::string on_error = "stop";  ///< What an exception in a callback means for the component.
  double watchdog_s = 5.0;        ///< Default: the container's.
  std::map<std::string, Remap, std::less<>> remap;  ///< Port -> topic.
  ParameterMap parameters;
  Location location;         ///< Of the entry.
  Location plugin_location;  ///< Of the value of `plugin`.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("plugin", self.plugin, config::not_empty());
    field("name", self.name, config::not_empty());
    field("executor", self.executor);
    field("on_error", self.on_error, config::one_of({"stop", "restart", "ignore"}));
    field("watchdog_s", self.watchdog_s, config::at_least(0.0), config::at_most(86400.0));
  }
};

/// A whole config file.
struct SystemConfig {
  ContainerConfig container;
  /// Section `parameters` and the files of `parameter_files`: for every component that has a
  /// parameter of that name and is not given its own.
  ParameterMap shared_parameters;
  std::set<std::string> file_parameters;  ///< Which of them come from a file.
  std::map<std::string, TopicConfig, std::less<>> topics;
  std::map<std::string, Location, std::less<>> topic_locations;
  std::vector<ComponentConfig> components;
};

/// What could be read, and everything that is wrong with it.
struct ConfigReadout {
  SystemConfig config;
  std::vector<Problem> problems;
};

/// What the command line adds to a config file.
struct ConfigOverrides {
  /// "component.parameter=value", "container.key=value" or "parameters.key=value" (shared), with
  /// values as in YAML; they win over all files.
  std::vector<std::string> values;
  /// Files of shared parameters; they win over the config's own shared parameters.
  std::vector<std::filesystem::path> parameter_files;
};

/// Reads a config file. Paths in its `parameter_files` are relative to its folder.
[[nodiscard]] ConfigReadout read_config_file(const std::filesystem::path& file,
                                             const ConfigOverrides& overrides = {});

/// The same from text; `origin` takes the place of the file name.
[[nodiscard]] ConfigReadout parse_config(const std::string& text,
                                         const std::string& origin,
                                         const ConfigOverrides& overrides = {});

/// A value written as YAML ("1", "1.0", "text", "[1, 2]") with its ROS type. Problems, if any, are
/// appended and name `location`.
[[nodiscard]] config::Value parse_value(const std::string& yaml,
                                        const Location& location,
                                        std::vector<Problem>& problems);

/// What is wrong with the name of a component or container, or "".
[[nodiscard]] std::string component_name_problem(std::string_view name);

/// Sorted by line, each problem once.
void sort_problems(std::vector<Problem>& problems);

}  // namespace camvox::bringup
