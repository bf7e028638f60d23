#include "load_request.hpp"

#include "camvox/bringup/parameter_messages.hpp"
#include "camvox/interfaces/topics.hpp"

namespace camvox::bringup {
namespace {

using rcl_interfaces::msg::Parameter;

const Location kOrigin{"load_node", 0};

/// "camvox::ThingComponent" -> "thing": the name when none is given.
std::string default_name(const std::string& plugin) {
  std::string name = plugin.substr(plugin.rfind(':') + 1);
  if (name.ends_with("Component") && name.size() > 9) name.resize(name.size() - 9);
  std::string snake;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    if (upper && !snake.empty()) snake += '_';
    snake += upper ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return snake;
}

ParameterMap to_parameters(const std::vector<Parameter>& messages, std::vector<Problem>& problems) {
  ParameterMap parameters;
  for (const auto& message : messages) {
    if (const auto value = from_message(message.value())) {
      parameters[message.name()] = {*value, kOrigin};
    } else {
      problems.push_back({kOrigin, message.name(), "has no value, or one of an unknown type"});
    }
  }
  return parameters;
}

void add_remap(const std::string& rule, ComponentConfig& config, std::vector<Problem>& problems) {
  const auto separator = rule.find(":=");
  if (separator == std::string::npos) {
    problems.push_back({kOrigin, rule, "expected port:=/topic"});
    return;
  }
  const auto topic = rule.substr(separator + 2);
  if (const auto problem = interfaces::topics::name_problem(topic); !problem.empty()) {
    problems.push_back({kOrigin, rule, problem});
  }
  config.remap[rule.substr(0, separator)] = {topic, kOrigin};
}

}  // namespace

ComponentConfig to_component_config(const composition_interfaces::srv::LoadNode_Request& request) {
  std::vector<Problem> problems;
  ComponentConfig config;
  auto extra = to_parameters(request.extra_arguments(), problems);
  extra.erase("use_intra_process_comms");  // always on here; launch files set it
  for (const auto& problem : config::load(extra, config)) problems.push_back(problem);
  config.plugin = request.plugin_name();
  config.name = request.node_name().empty() ? default_name(config.plugin) : request.node_name();
  config.location = config.plugin_location = kOrigin;
  config.parameters = to_parameters(request.parameters(), problems);
  for (const auto& rule : request.remap_rules()) add_remap(rule, config, problems);
  if (const auto& space = request.node_namespace(); !space.empty() && space != "/") {
    problems.push_back({kOrigin,
                        "node_namespace",
                        "components have no namespace; give full topic names in remap"});
  }
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return config;
}

}  // namespace camvox::bringup
