#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "camvox/bringup/parameter_messages.hpp"
#include "camvox/bringup/plugin_index.hpp"
#include "camvox/bringup/system_config.hpp"
#include "camvox/interfaces/composition_interfaces.hpp"
#include "session.hpp"

namespace camvox::command {
namespace {

using namespace composition_interfaces::srv;

struct ComponentOptions {
  std::string package;
  std::string container;
  bool containers_only = false;
  bool quiet = false;
  LoadNode_Request load;
  std::string plugin;
  std::string name;
  std::vector<std::string> remap;
  std::vector<std::string> parameters;
  std::vector<std::string> extra;
  std::vector<std::uint64_t> ids;
};

int types(const ComponentOptions& options) {
  std::map<std::string, std::vector<std::string>> classes;
  for (const auto& plugin : bringup::find_plugins()) {
    classes[plugin.package].push_back(plugin.class_name);
  }
  if (!options.package.empty() && !classes.contains(options.package)) {
    throw CommandError("no installed package '" + options.package + "' has components");
  }
  if (classes.empty()) {
    throw CommandError(
        "no installed package has components; build the workspace, or add the "
        "install prefix to AMENT_PREFIX_PATH");
  }
  for (const auto& [package, names] : classes) {
    if (!options.package.empty() && package != options.package) continue;
    if (options.package.empty()) fmt::print("{}\n", package);
    for (const auto& name : names) fmt::print("{}{}\n", options.package.empty() ? "  " : "", name);
  }
  return Exit::kDone;
}

std::string service(const std::string& container, const char* verb) {
  return with_slash(container) + "/_container/" + verb;
}

void print_nodes(const Session& session, const std::string& container, const char* indent) {
  const auto nodes =
      session.call<ListNodes_Request, ListNodes_Response>(service(container, "list_nodes"), {});
  for (std::size_t i = 0; i < nodes.unique_ids().size() && i < nodes.full_node_names().size();
       ++i) {
    fmt::print("{}{}  {}\n", indent, nodes.unique_ids()[i], nodes.full_node_names()[i]);
  }
}

int list(const CommonOptions& common, const ComponentOptions& options) {
  const Session session(common);
  if (!options.container.empty()) {
    print_nodes(session, options.container, "");
    return Exit::kDone;
  }
  constexpr auto kSuffix = "/_container/list_nodes";
  const auto containers = session.owners_of(kSuffix, session.settled());
  if (containers.empty()) throw CommandError("no container runs on " + session.domain_text());
  for (const auto& container : containers) {
    fmt::print("{}\n", container);
    if (!options.containers_only) print_nodes(session, container, "  ");
  }
  return Exit::kDone;
}

/// "name:=value" pairs as parameter messages; values as in YAML.
std::vector<rcl_interfaces::msg::Parameter> to_messages(const std::vector<std::string>& texts) {
  std::vector<rcl_interfaces::msg::Parameter> messages;
  std::vector<config::Problem> problems;
  for (const auto& text : texts) {
    const auto separator = text.find(":=");
    if (separator == std::string::npos) throw CommandError("'" + text + "': expected name:=value");
    auto& message = messages.emplace_back();
    message.name(text.substr(0, separator));
    message.value(
        bringup::to_message(bringup::parse_value(text.substr(separator + 2), {text, 0}, problems)));
  }
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return messages;
}

int load(const CommonOptions& common, const ComponentOptions& options) {
  LoadNode_Request request;
  request.package_name(options.package);
  request.plugin_name(options.plugin);
  request.node_name(options.name);
  request.remap_rules(options.remap);
  request.parameters(to_messages(options.parameters));
  request.extra_arguments(to_messages(options.extra));
  const Session session(common);
  const auto response = session.call<LoadNode_Request, LoadNode_Response>(
      service(options.container, "load_node"), request);
  if (!response.success()) {
    throw CommandError("failed to load component: " + response.error_message());
  }
  if (options.quiet) {
    fmt::print("{}  {}\n", response.unique_id(), response.full_node_name());
  } else {
    fmt::print("Loaded component {} into '{}' container node as '{}'\n",
               response.unique_id(),
               with_slash(options.container),
               response.full_node_name());
  }
  return Exit::kDone;
}

int unload(const CommonOptions& common, const ComponentOptions& options) {
  const Session session(common);
  for (const auto id : options.ids) {
    UnloadNode_Request request;
    request.unique_id(id);
    const auto response = session.call<UnloadNode_Request, UnloadNode_Response>(
        service(options.container, "unload_node"), request);
    if (!response.success()) {
      throw CommandError(fmt::format("failed to unload component {} from '{}': {}",
                                     id,
                                     with_slash(options.container),
                                     response.error_message()));
    }
    if (!options.quiet) {
      fmt::print("Unloaded component {} from '{}' container\n", id, with_slash(options.container));
    }
  }
  return Exit::kDone;
}

void add_load(CLI::App& group, ComponentOptions& options) {
  auto* command = group.add_subcommand("load", "Load a component into a running container");
  command->add_option("container", options.container, "Its name, e.g. /camvox")->required();
  command->add_option("package", options.package, "Package of the plugin")->required();
  command->add_option("plugin", options.plugin, "Class name, e.g. camvox::SinkComponent")
      ->required();
  command->add_option(
      "-n,--node-name", options.name, "Name of the component (default: from the class)");
  command->add_option("-r,--remap-rule", options.remap, "port:=/topic")->allow_extra_args(false);
  command->add_option("-p,--parameter", options.parameters, "name:=value")->allow_extra_args(false);
  command
      ->add_option("-e,--extra-argument",
                   options.extra,
                   "executor:=name, on_error:=stop|restart|ignore, watchdog_s:=5.0")
      ->allow_extra_args(false);
  command->add_flag("-q,--quiet", options.quiet, "Print only the id and the name");
}

}  // namespace

void add_component(CLI::App& app, const CommonOptions& common, Action& action) {
  auto options = std::make_shared<ComponentOptions>();
  auto* group =
      app.add_subcommand("component", "Components: installed ones, and those in containers");
  group->require_subcommand(1)->fallthrough();
  auto* types_command = group->add_subcommand("types", "List the installed component classes");
  types_command->add_option("package", options->package, "Only of this package");
  auto* list_command = group->add_subcommand("list", "List containers and their components");
  list_command->add_option("container", options->container, "Only of this container");
  list_command->add_flag("--containers-only", options->containers_only, "Without their components");
  add_load(*group, *options);
  auto* unload_command =
      group->add_subcommand("unload", "End and remove components of a container");
  unload_command->add_option("container", options->container, "Its name")->required();
  unload_command->add_option("id", options->ids, "Ids, as 'component list' shows them")->required();
  unload_command->add_flag("-q,--quiet", options->quiet, "Print nothing");

  const auto act = [&](const char* verb, auto function) {
    auto* command = group->get_subcommand(verb);
    command->fallthrough();
    command->callback([&action, function, options] {
      action = [function, options] { return function(*options); };
    });
  };
  act("types", [](const auto& chosen) { return types(chosen); });
  act("list", [&common](const auto& chosen) { return list(common, chosen); });
  act("load", [&common](const auto& chosen) { return load(common, chosen); });
  act("unload", [&common](const auto& chosen) { return unload(common, chosen); });
}

}  // namespace camvox::command
