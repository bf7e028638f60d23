#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "camvox/bringup/container.hpp"
#include "command.hpp"
#include "container_run.hpp"
#include "recorded_inputs.hpp"

namespace camvox::command {
namespace {

using namespace camvox::bringup;

struct RunOptions {
  std::string config;
  ConfigOverrides overrides;
  std::string bag;  ///< Replayed, if not empty.
  bool lockstep = false;
  std::string output;  ///< Folder for results, if not empty.
  std::string map;     ///< Map file to start with, if not empty.
  bool localisation_only = false;
  bool overwrite = false;
  bool check = false;
  bool print_config = false;
};

/// The environment wins over the file, and --set over both.
ContainerConfig with_environment(const ContainerConfig& config, const RunOptions& options) {
  const auto is_set = [&options](const std::string& key) {
    return std::any_of(
        options.overrides.values.begin(), options.overrides.values.end(), [&key](const auto& text) {
          return text.starts_with("container." + key + "=");
        });
  };
  ContainerConfig result = with_ros_environment(config);
  if (is_set("domain_id")) result.domain_id = config.domain_id;
  if (is_set("network")) result.network = config.network;
  if (is_set("peers")) result.peers = config.peers;
  return result;
}

config::Parameter from_command_line(config::Value value, const std::string& option) {
  return {std::move(value), {option, 0}};
}

/// The component that replays `--bag`: the config's own, or one that is added.
void replay_bag(const std::string& bag, SystemConfig& config) {
  static constexpr auto kPlugin = "camvox::ReplayComponent";
  auto replay = std::find_if(config.components.begin(),
                             config.components.end(),
                             [](const auto& component) { return component.plugin == kPlugin; });
  if (replay == config.components.end()) {
    ComponentConfig added;
    added.plugin = kPlugin;
    added.name = "replay";
    added.location = added.plugin_location = {"--bag", 0};
    added.watchdog_s = 0.0;
    replay = config.components.insert(config.components.end(), std::move(added));
  }
  replay->parameters["bag"] = from_command_line(bag, "--bag");
  replay->parameters.try_emplace("exit_at_end", from_command_line(true, "--bag"));
  config.file_parameters.insert("fail_without_poses");  // no error when nothing follows the poses
  config.shared_parameters.try_emplace("fail_without_poses", from_command_line(true, "--bag"));
}

/// With it comes that mapping waits for loops, if the config has them: when one is found must not
/// depend on how busy the machine is.
void use_lockstep(SystemConfig& config) {
  config.shared_parameters["lockstep"] = from_command_line(true, "--lockstep");
  const bool loops =
      std::any_of(config.components.begin(), config.components.end(), [](const auto& component) {
        return component.plugin == "camvox::LoopClosingComponent";
      });
  if (!loops || config.shared_parameters.contains("wait_for_loop_closing")) return;
  config.file_parameters.insert("wait_for_loop_closing");  // no error without mapping
  config.shared_parameters["wait_for_loop_closing"] = from_command_line(true, "--lockstep");
}

/// Carries the options over into what the config says.
void apply_options(const RunOptions& options, SystemConfig& config) {
  if (!options.bag.empty()) replay_bag(options.bag, config);
  if (options.lockstep) use_lockstep(config);
  if (!options.map.empty())
    config.shared_parameters["load_map"] = from_command_line(options.map, "--map");
  if (options.localisation_only) {
    config.shared_parameters["localisation_only"] = from_command_line(true, "--localisation-only");
  }
  if (!options.output.empty()) {
    config.file_parameters.insert("output_dir");  // no error when no component saves anything
    config.shared_parameters["output_dir"] =
        from_command_line(std::filesystem::absolute(options.output).string(), "--out");
  }
}

CheckedConfig check_config(const RunOptions& options, PluginLoader& plugins) {
  auto [config, problems] = read_config_file(find_config(options.config), options.overrides);
  apply_options(options, config);
  auto probed = probe_system(config, plugins);
  problems.insert(problems.end(), probed.problems.begin(), probed.problems.end());
  sort_problems(problems);
  if (!problems.empty()) refuse(problems);
  config.container = with_environment(config.container, options);
  return {std::move(config), std::move(probed)};
}

/// Makes the folder of --out and puts the config there, so that results say how they came about.
void prepare_output(const RunOptions& options, const std::string& effective) {
  const std::filesystem::path folder = options.output;
  std::error_code error;
  if (std::filesystem::exists(folder) && !std::filesystem::is_directory(folder))
    throw CommandError(fmt::format("--out {}: is a file, not a folder", options.output));
  const bool used = std::filesystem::exists(folder) && !std::filesystem::is_empty(folder, error);
  if (used && !options.overwrite) {
    throw CommandError(fmt::format(
        "--out {}: is not empty; choose another folder, or add --overwrite", options.output));
  }
  std::filesystem::create_directories(folder, error);
  std::ofstream file(folder / "config.yaml");
  if (!(file << effective << std::flush)) {
    throw CommandError(fmt::format("--out {}: cannot write there", options.output));
  }
}

/// A calibration that nobody gave is that of the CamVox paper's rig: wrong for any other.
void warn_of_default_calibration(const std::vector<ProbedComponent>& components, Logger& log) {
  for (const std::string name : {"camera", "rig"}) {
    bool used = false;
    bool given = false;
    for (const auto& component : components) {
      for (const auto& [key, parameter] : component.effective_parameters) {
        // Replay has but the time offset, and none is as good as any guess.
        if (!key.starts_with(name + ".") || key == "rig.camera_time_offset_ns") continue;
        used = true;
        given = given || parameter.location.to_string() != "default";
      }
    }
    if (!used || given) continue;
    log.warn(
        "no calibration `{}` is given: takes that of the CamVox paper's rig; give your own with "
        "--parameters rig.yaml, or under `parameters:` in the config",
        name);
  }
}

/// No container knows how another one runs: only the one who starts them does.
void remind_of_other_containers(const RunOptions& options,
                                const ContainerConfig& container,
                                Logger& log) {
  if (!options.lockstep || container.external_topics.empty()) return;
  log.info("--lockstep: the container that publishes {} must run with it, too",
           fmt::join(container.external_topics, ", "));
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
  if (!options.map.empty() && !std::filesystem::exists(options.map))
    throw CommandError(fmt::format("--map {}: there is no such file", options.map));
  if (!options.output.empty()) prepare_output(options, text);
  fmt::print("# effective config\n{}", text);
  std::fflush(stdout);
  const auto loggers = console_loggers(parse_log_level(checked.config.container.log_level));
  const auto log = loggers(checked.config.container.name);
  warn_of_default_calibration(checked.probed.components, *log);
  warn_of_unrecorded_inputs(checked.probed, *log);
  remind_of_other_containers(options, checked.config.container, *log);
  return run_container(std::move(checked), plugins, loggers);
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
                   options->overrides.values,
                   "component.parameter=value, parameters.key=value (for all components) or "
                   "container.key=value, instead of the file's")
      ->allow_extra_args(false);
  command
      ->add_option("--parameters",
                   options->overrides.parameter_files,
                   "File of parameters for all components, e.g. the rig.yaml of a recording")
      ->allow_extra_args(false);
  command->add_option("--bag", options->bag, "Recording to replay; the run ends with it");
  command->add_flag("--lockstep",
                    options->lockstep,
                    "Replay as fast as possible, dropping nothing, the same bytes each time");
  command->add_option("--out", options->output, "Folder for results");
  auto* map = command->add_option("--map", options->map, "Map file of another run to start with");
  command
      ->add_flag("--localisation-only",
                 options->localisation_only,
                 "Only find and follow the pose in --map; the map stays as it is")
      ->needs(map);
  command->add_flag("--overwrite", options->overwrite, "Let --out be a folder with files in it");
  command->add_flag("--check", options->check, "Only check the config");
  command->add_flag("--print-config",
                    options->print_config,
                    "Only check the config and print it with all defaults");
  command->footer(
      "Exit code: 0 stopped by Ctrl-C, SIGTERM or the end of --bag, 1 could not start, 2 wrong "
      "command line,\n"
      "3 a component had failed or hung, or could not save its results, or no frame of --bag was "
      "tracked,\n130 killed by a second Ctrl-C.");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
