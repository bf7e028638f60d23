#include <fmt/format.h>

#include "camvox/bringup/probe.hpp"

namespace camvox::bringup {
namespace {

/// "    key: value  # origin".
std::string line(int indent,
                 std::string_view key,
                 const std::string& value,
                 const std::string& origin = {}) {
  return fmt::format(
      "{:{}}{}: {}{}\n", "", indent, key, value, origin.empty() ? "" : "  # " + origin);
}

template <typename Config>
std::string section(int indent, const Config& config) {
  std::string text;
  for (const auto& [key, parameter] : config::dump(config)) {
    text += line(indent, key, config::to_yaml(parameter.value));
  }
  return text;
}

std::string component_text(const ComponentConfig& component, const ProbedComponent& probed) {
  std::string text =
      fmt::format("  - plugin: {}\n    name: {}\n", component.plugin, component.name);
  if (!component.executor.empty()) text += line(4, "executor", config::to_yaml(component.executor));
  text += line(4, "on_error", component.on_error);
  text += line(4, "watchdog_s", config::to_yaml(component.watchdog_s));
  if (!probed.ports.empty()) text += "    remap:\n";
  std::map<std::string, const ProbedPort*> ports;  // a port may be asked for twice
  for (const auto& port : probed.ports) ports.emplace(port.name, &port);
  for (const auto& [name, port] : ports) {
    text += line(6, name, port->topic, (port->is_output ? "out, " : "in, ") + port->type_name);
  }
  if (!probed.effective_parameters.empty()) text += "    parameters:\n";
  for (const auto& [key, parameter] : probed.effective_parameters) {
    text += line(6, key, config::to_yaml(parameter.value), parameter.location.to_string());
  }
  return text;
}

}  // namespace

std::string effective_config(const SystemConfig& config,
                             const std::vector<ProbedComponent>& components) {
  std::string text = "container:\n" + section(2, config.container);
  if (!config.topics.empty()) text += "topics:\n";
  for (const auto& [topic, settings] : config.topics) {
    text += "  " + topic + ":\n" + section(4, settings);
  }
  text += components.empty() ? "components: []\n" : "components:\n";
  for (std::size_t i = 0; i < components.size(); ++i) {
    text += component_text(config.components[i], components[i]);
  }
  return text;
}

}  // namespace camvox::bringup
