#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <thread>

#include "camvox/bringup/parameter_file.hpp"
#include "camvox/import/simulated_bag.hpp"
#include "camvox/sensors/rig.hpp"
#include "command.hpp"
#include "import_report_text.hpp"
#include "progress_bar.hpp"
#include "signals.hpp"

namespace camvox::command {
namespace {

using config::Problem;
using simulation::SimulationOptions;

/// What the command line says.
struct SimulateWords {
  std::string what;  ///< A preset, or a file.
  std::string output;
  std::vector<std::string> assignments;
  int jobs = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U));
  std::string compression = "zstd";
  std::string images = "jpeg";
  std::uint64_t max_bag_size = 0;
  std::string trajectory;
  std::string trajectory_of = "body";
  bool truth_depth = false;
  bool truth_points = false;
  bool overwrite = false;
  bool print_options = false;
};

bool is_file_name(const std::string& what) {
  return what.ends_with(".yaml") || what.ends_with(".yml") || what.find('/') != std::string::npos;
}

/// Key `preset` of an options file, on which the rest of the file builds.
SimulationOptions base_of(config::ParameterMap& parameters, std::vector<Problem>& problems) {
  const auto found = parameters.find("preset");
  if (found == parameters.end()) return {};
  const auto parameter = found->second;
  parameters.erase(found);
  const auto* name = std::get_if<std::string>(&parameter.value);
  try {
    return simulation::preset(name != nullptr ? *name : config::to_yaml(parameter.value));
  } catch (const config::ConfigError& error) {
    for (const auto& problem : error.problems()) {
      problems.push_back({parameter.location, "preset", problem.key + ": " + problem.message});
    }
  }
  return {};
}

/// Preset or file, then --set on top; throws config::ConfigError with all that is wrong.
SimulationOptions options_of(const SimulateWords& words) {
  std::vector<Problem> problems;
  config::ParameterMap parameters;
  SimulationOptions options;
  if (is_file_name(words.what)) {
    parameters = bringup::read_parameter_file(words.what, problems);
    options = base_of(parameters, problems);
  } else {
    options = simulation::preset(words.what);
  }
  for (auto& [key, parameter] : bringup::parse_assignments(words.assignments, "--set", problems)) {
    parameters.insert_or_assign(key, std::move(parameter));
  }
  for (auto& problem : config::load(parameters, options)) problems.push_back(std::move(problem));
  if (!words.trajectory.empty()) options.motion = "given";
  if (problems.empty()) problems = simulation::check(options);
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  return options;
}

/// The motion of --trajectory, if there is one.
std::optional<simulation::Trajectory> motion_of(const SimulateWords& words,
                                                const SimulationOptions& options) {
  if (words.trajectory.empty()) return std::nullopt;
  const auto T_body_camera = sensors::make_rig_calibration(options.rig).T_body_camera;
  auto motion = import::read_motion(
      words.trajectory, words.trajectory_of == "camera" ? T_body_camera : geometry::SE3());
  if (!motion.ok()) throw CommandError(motion.status().message());
  return *std::move(motion);
}

import::SimulatedBagOptions bag_options(const SimulateWords& words){import::SimulatedBagOptions bag;
const auto name = std::filesystem::path(words.what).stem().string();
bag.output = words.output.empty() ? name : words.output;
bag.bag.mcap.compression = words.compression == "none"
                               ? storage::Compression::kNone
                               : storage::parse_compression(words.compression).value();
bag.bag.max_file_size = words.max_bag_size;
bag.replace = words.overwrite;
bag.raw_images = words.images == "raw";
bag.truth_depth = words.truth_depth;
bag.truth_points = words.truth_points;
bag.threads = words.jobs;
return bag;
}  // namespace

int simulate(const SimulateWords& words) {
  SimulationOptions options;
  try {
    options = options_of(words);
  } catch (const config::ConfigError& error) {
    fmt::print(stderr, "camvox: {}\n", error.what());
    return Exit::kBadUsage;
  }
  if (words.print_options) {
    fmt::print("{}", config::to_yaml(config::dump(options)));
    return Exit::kDone;
  }
  auto bag = bag_options(words);
  bag.trajectory = motion_of(words, options);
  StopSignal stop;
  bool stopped = false;
  const auto begin = std::chrono::steady_clock::now();
  auto result = [&] {
    ProgressBar bar("simulate " + words.what);
    bag.progress = [&](const import::ImportProgress& progress) {
      bar.update(progress.done, progress.total);
      stopped = stop.wait(std::chrono::milliseconds(0));
      return !stopped;
    };
    return import::write_simulated_bag(options, bag);
  }();
  if (stopped) {
    fmt::print(stderr, "camvox: {}\n", result.status().message());
    return Exit::kInterrupted;
  }
  if (!result.ok()) throw CommandError(result.status().message());
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
  fmt::print("{}took {:.1f} s\n", report_text(*result), elapsed.count());
  return Exit::kDone;
}

std::string preset_list() {
  std::string names;
  for (const auto& name : simulation::preset_names()) names += (names.empty() ? "" : ", ") + name;
  return names;
}

void add_bag_words(CLI::App& command, SimulateWords& words) {
  command.add_option("-o,--output",
                     words.output,
                     "Folder of the bag; must not exist (default: named after the preset or file)");
  command.add_flag("--overwrite", words.overwrite, "Replace a bag that is there, once all is done");
  command.add_option("--compression", words.compression, "none, lz4 or zstd (default: zstd)")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}));
  command.add_option("-b,--max-bag-size",
                     words.max_bag_size,
                     "Start a new file after this many bytes (default: 0, never)");
  command.add_option("--images", words.images, "jpeg or raw (default: jpeg)")
      ->check(CLI::IsMember({"jpeg", "raw"}));
  command.add_flag(
      "--truth-depth", words.truth_depth, "Also the true depth of every pixel: 3.5 MB an image");
  command.add_flag(
      "--truth-points", words.truth_points, "Also the points without noise and motion");
}

}  // namespace camvox::command

void add_simulate(CLI::App& app, Action& action) {
  auto words = std::make_shared<SimulateWords>();
  auto* command =
      app.add_subcommand("simulate", "Make a bag (MCAP) of a simulated drive, with its truth");
  command->fallthrough();
  command
      ->add_option("what", words->what, "Preset (" + preset_list() + ") or a YAML file of options")
      ->required();
  add_bag_words(*command, *words);
  command
      ->add_option(
          "--set", words->assignments, "key=value of an option, instead of the preset's or file's")
      ->allow_extra_args(false);
  command->add_option("-j,--jobs", words->jobs, "Threads (default: as many as cores)")
      ->check(CLI::Range(1, 256));
  command->add_option("--trajectory", words->trajectory, "Drive along this TUM file")
      ->check(CLI::ExistingFile);
  command
      ->add_option("--trajectory-of", words->trajectory_of, "body or camera (default: body): whose")
      ->check(CLI::IsMember({"body", "camera"}));
  command->add_flag(
      "--print-options", words->print_options, "Only print all options; they make an options file");
  command->footer(
      "Options are those that --print-options shows; an options file holds any of them, and\n"
      "'preset: NAME' to start from. The same options give the same bytes with any --jobs.");
  command->callback([words, &action] { action = [words] { return simulate(*words); }; });
}

}  // namespace camvox::command
