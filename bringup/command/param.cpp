#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "camvox/bringup/parameter_messages.hpp"
#include "camvox/bringup/system_config.hpp"
#include "camvox/interfaces/rcl_interfaces.hpp"
#include "session.hpp"

namespace camvox::command {
namespace {

using namespace rcl_interfaces::srv;

struct ParamOptions {
  std::string component;
  std::string parameter;
  std::string value;
  bool hide_type = false;
};

std::vector<std::string> names_of(const Session& session, const std::string& component) {
  return session
      .call<ListParameters_Request, ListParameters_Response>(component + "/list_parameters", {})
      .result()
      .names();
}

std::vector<rcl_interfaces::msg::ParameterValue> values_of(const Session& session,
                                                           const std::string& component,
                                                           const std::vector<std::string>& names) {
  GetParameters_Request request;
  request.names(names);
  const auto response = session.call<GetParameters_Request, GetParameters_Response>(
      component + "/get_parameters", request);
  if (response.values().size() != names.size()) {
    throw CommandError(component + " answered with the wrong number of values");
  }
  return response.values();
}

int list(const CommonOptions& common, const ParamOptions& options) {
  const Session session(common);
  std::vector<std::string> components = {with_slash(options.component)};
  if (options.component.empty()) {
    components = session.owners_of("/list_parameters", session.settled());
    if (components.empty()) {
      throw CommandError("nothing with parameters runs on " + session.domain_text());
    }
  }
  for (const auto& component : components) {
    fmt::print("{}:\n", component);
    for (const auto& name : names_of(session, component)) fmt::print("  {}\n", name);
  }
  return Exit::kDone;
}

/// "Double value is: 0.5", as ros2 param get has it.
std::string described(const config::Value& value) {
  static constexpr const char* kTypes[] = {"Boolean", "Integer", "Double", "String"};
  const auto kind = value.index();
  const auto text = kind == 3 ? std::get<std::string>(value) : config::to_yaml(value);
  return kind < 4 ? fmt::format("{} value is: {}", kTypes[kind], text)
                  : fmt::format("{} values are: {}", kTypes[kind - 4], text);
}

int get(const CommonOptions& common, const ParamOptions& options) {
  const Session session(common);
  const auto component = with_slash(options.component);
  const auto value =
      bringup::from_message(values_of(session, component, {options.parameter}).front());
  if (!value) {
    throw CommandError(fmt::format("{} has no parameter '{}'", component, options.parameter));
  }
  fmt::print("{}\n", options.hide_type ? config::to_yaml(*value) : described(*value));
  return Exit::kDone;
}

int set(const CommonOptions& common, const ParamOptions& options) {
  std::vector<config::Problem> problems;
  const auto value = bringup::parse_value(options.value, {options.value, 0}, problems);
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  SetParameters_Request request;
  auto& parameter = request.parameters().emplace_back();
  parameter.name(options.parameter);
  parameter.value(bringup::to_message(value));
  const Session session(common);
  const auto response = session.call<SetParameters_Request, SetParameters_Response>(
      with_slash(options.component) + "/set_parameters", request);
  if (response.results().size() != 1 || !response.results().front().successful()) {
    throw CommandError(
        "setting the parameter failed: " +
        (response.results().empty() ? "no result" : response.results().front().reason()));
  }
  fmt::print("Set parameter successful\n");
  return Exit::kDone;
}

int dump(const CommonOptions& common, const ParamOptions& options) {
  const Session session(common);
  const auto component = with_slash(options.component);
  const auto names = names_of(session, component);
  const auto values = values_of(session, component, names);
  fmt::print("{}:\n  ros__parameters:{}\n", component, names.empty() ? " {}" : "");
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto value = bringup::from_message(values[i])) {
      fmt::print("    {}: {}\n", names[i], config::to_yaml(*value));
    }
  }
  return Exit::kDone;
}

}  // namespace

void add_param(CLI::App& app, const CommonOptions& common, Action& action) {
  auto options = std::make_shared<ParamOptions>();
  auto* group = app.add_subcommand("param", "Parameters of running components");
  group->require_subcommand(1)->fallthrough();
  const auto add = [&](const char* verb, const char* help, auto function) {
    auto* command = group->add_subcommand(verb, help);
    command->fallthrough();
    command->callback([&action, &common, function, options] {
      action = [function, &common, options] { return function(common, *options); };
    });
    return command;
  };
  add("list", "List the parameters of one or all components", list)
      ->add_option("component", options->component, "Its name");
  auto* get_command = add("get", "Print the value of a parameter", get);
  auto* set_command = add("set", "Change a parameter of a running component", set);
  for (auto* command : {get_command, set_command}) {
    command->add_option("component", options->component, "Its name")->required();
    command->add_option("parameter", options->parameter, "e.g. ransac.iterations")->required();
  }
  get_command->add_flag("--hide-type", options->hide_type, "Print only the value");
  set_command->add_option("value", options->value, "As in YAML: 1, 1.0, text, [1, 2]")->required();
  add("dump", "Print all parameters of a component as YAML", dump)
      ->add_option("component", options->component, "Its name")
      ->required();
}

}  // namespace camvox::command
