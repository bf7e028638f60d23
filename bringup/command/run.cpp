#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "camvox/bringup/container.hpp"
#include "command.hpp"
#include "signals.hpp"

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
using namespace camvox::bringup;

constexpr auto kStopTimeout = 1300ms;   // for components to end, of the 2 s that a stop may take
constexpr auto kStopPatience = 1800ms;  // for everything

struct RunOptions {
  std::string config;
  std::vector<std::string> overrides;
  bool check = false;
  bool print_config = false;
};

/// The file, or the one of that name among the installed configs.
std::filesystem::path find_config(const std::string& name) {
  if (std::filesystem::exists(name)) return name;
  std::error_code ignored;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored);
  const auto installed = program.parent_path().parent_path() / "share/camvox_bringup/config" / name;
  return std::filesystem::is_regular_file(installed, ignored) ? installed
                                                              : std::filesystem::path(name);
}

[[noreturn]] void refuse(const std::vector<Problem>& problems) {
  for (const auto& problem : problems) fmt::print(stderr, "{}\n", problem.to_string());
  throw CommandError(fmt::format("{} problem{} in the config; nothing was started",
                                 problems.size(),
                                 problems.size() == 1 ? "" : "s"));
}

struct CheckedConfig {
  SystemConfig config;
  ProbedSystem probed;
};

/// The environment wins over the file, and --set over both.
ContainerConfig with_environment(const ContainerConfig& config, const RunOptions& options) {
  const auto is_set = [&options](const std::string& key) {
    return std::any_of(
        options.overrides.begin(), options.overrides.end(), [&key](const auto& text) {
          return text.starts_with("container." + key + "=");
        });
  };
  ContainerConfig result = with_ros_environment(config);
  if (is_set("domain_id")) result.domain_id = config.domain_id;
  if (is_set("network")) result.network = config.network;
  if (is_set("peers")) result.peers = config.peers;
  return result;
}

CheckedConfig check_config(const RunOptions& options, PluginLoader& plugins) {
  auto [config, problems] = read_config_file(find_config(options.config), options.overrides);
  auto probed = probe_system(config, plugins);
  problems.insert(problems.end(), probed.problems.begin(), probed.problems.end());
  sort_problems(problems);
  if (!problems.empty()) refuse(problems);
  config.container = with_environment(config.container, options);
  return {std::move(config), std::move(probed)};
}

/// 0, or kUnclean if a component is not as it should be.
int final_state(const std::vector<ComponentInfo>& components) {
  const bool fine = std::all_of(components.begin(), components.end(), [](const auto& component) {
    return component.state == ComponentState::kRunning;
  });
  return fine ? Exit::kDone : Exit::kUnclean;
}

int run_container(CheckedConfig checked, std::shared_ptr<PluginLoader> plugins) {
  const auto loggers = console_loggers(parse_log_level(checked.config.container.log_level));
  const auto log = loggers(checked.config.container.name);
  auto container = std::make_unique<Container>(
      std::move(checked.config), std::move(checked.probed), std::move(plugins), loggers);
  ExitGuard guard(kStopPatience, [&container, log] {
    log->error("does not end: still {}; exits without it", container->current_activity());
  });
  container->start();
  guard.wait();
  log->info("stops");
  const int code = final_state(container->components());
  const auto hung = container->stop(kStopTimeout);
  if (!hung.empty()) {
    log->error(
        "exits without {}, which hang{}", fmt::join(hung, ", "), hung.size() == 1 ? "s" : "");
    std::_Exit(Exit::kUnclean);  // their threads still use what destructors would take away
  }
  log->info("stopped");
  return code;
}

int run(const RunOptions& options) {
  const auto plugins = std::make_shared<PluginLoader>();
  auto checked = check_config(options, *plugins);
  const auto text = effective_config(checked.config, checked.probed.components);
  if (options.print_config) {
    fmt::print("{}", text);
    return Exit::kDone;
  }
  if (options.check) {
    const auto count = checked.config.components.size();
    fmt::print("{}: valid, {} component{}\n", options.config, count, count == 1 ? "" : "s");
    return Exit::kDone;
  }
  fmt::print("# effective config\n{}", text);
  std::fflush(stdout);
  return run_container(std::move(checked), plugins);
}

}  // namespace

void add_run(CLI::App& app, Action& action) {
  auto options = std::make_shared<RunOptions>();
  auto* command = app.add_subcommand("run", "Run a container from a config file until Ctrl-C");
  command->fallthrough();
  command->add_option("config", options->config, "Config file, or the name of an installed one")
      ->required();
  command
      ->add_option("--set",
                   options->overrides,
                   "component.parameter=value or container.key=value, instead of the file's")
      ->allow_extra_args(false);
  command->add_flag("--check", options->check, "Only check the config");
  command->add_flag("--print-config",
                    options->print_config,
                    "Only check the config and print it with all defaults");
  command->footer(
      "Exit code: 0 stopped by Ctrl-C or SIGTERM, 1 could not start, 2 wrong command line,\n"
      "3 a component had failed or hung, 130 killed by a second Ctrl-C.");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
