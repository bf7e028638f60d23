#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "camvox/storage/bag_reader.hpp"
#include "command.hpp"
#include "container_run.hpp"
#include "validators.hpp"

namespace camvox::command {
namespace {

using namespace camvox::bringup;
namespace fs = std::filesystem;

constexpr auto kReplay = "camvox::ReplayComponent";
constexpr auto kTracking = "camvox::TrackingComponent";
constexpr auto kOverlay = "depth_overlay";
/// What a depth image is made by; tracking tells deskew how fast the robot goes.
constexpr std::array kNeeded = {"camvox::SyncComponent",
                                "camvox::DeskewComponent",
                                "camvox::DepthComponent",
                                kTracking,
                                kReplay};

struct InspectOptions {
  std::string bag;
  std::string config;
  ConfigOverrides overrides;
  std::int64_t frame_id = 0;
  double stamp_s = 0.0;
  std::string output = "depth_overlay.png";
};

/// The installed config for what the bag brings depth in.
std::string config_for(const std::string& file) {
  const auto bag = storage::BagReader::open(file);
  if (!bag.ok()) throw CommandError(bag.status().message());
  const auto has = [&bag](std::string_view type, std::string_view name) {
    return std::ranges::any_of((*bag)->topics(), [&](const auto& topic) {
      return topic.type == type && (name.empty() || topic.name == name);
    });
  };
  if (has("livox_ros_driver2/msg/CustomMsg", "")) return "replay.yaml";
  if (has("sensor_msgs/msg/PointCloud2", "")) return "kitti.yaml";
  if (has("sensor_msgs/msg/Image", interfaces::topics::kRegisteredDepth)) return "rgbd.yaml";
  throw CommandError(file + ": has neither lidar points nor depth images");
}

config::Parameter given(config::Value value) { return {std::move(value), {"camvox inspect", 0}}; }

/// The config's own stages up to depth, and what draws their result.
SystemConfig reduced(SystemConfig config, const InspectOptions& options, const fs::path& picture) {
  std::erase_if(config.components, [](const auto& component) {
    return std::ranges::find(kNeeded, component.plugin) == kNeeded.end();
  });
  const auto lidar = std::ranges::any_of(config.components, [](const auto& component) {
    return component.plugin == "camvox::DepthComponent";
  });
  if (!lidar) {
    std::erase_if(config.components, [](const auto& c) { return c.plugin == kTracking; });
  }
  std::vector<std::string> stages = {kOverlay};  // it is to see every frame
  for (auto& component : config.components) {
    if (component.plugin != kReplay) stages.push_back(component.name);
    if (component.plugin == kTracking) component.parameters["wait_for_map"] = given(false);
  }
  for (auto& component : config.components) {
    if (component.plugin != kReplay) continue;
    component.parameters["bag"] = given(options.bag);
    component.parameters["exit_at_end"] = given(true);
    component.parameters["lockstep_components"] = given(stages);
  }
  ComponentConfig overlay;
  overlay.plugin = "camvox::DepthOverlayComponent";
  overlay.name = kOverlay;
  overlay.location = overlay.plugin_location = {"camvox inspect", 0};
  overlay.parameters["file"] = given(picture.string());
  overlay.parameters["exit_when_found"] = given(true);
  if (options.stamp_s > 0.0) {
    overlay.parameters["stamp_ns"] = given(std::int64_t{std::llround(1e9 * options.stamp_s)});
  } else {
    overlay.parameters["frame_id"] = given(options.frame_id);
  }
  config.components.push_back(std::move(overlay));
  config.shared_parameters["lockstep"] = given(true);
  return config;
}

/// A running robot must not notice: all topics get names that nobody else reads or writes.
void keep_apart(SystemConfig& config, const ProbedSystem& probed, const std::string& bag) {
  const std::string prefix = fmt::format("/inspect_{}", getpid());
  config.container.name = prefix.substr(1);
  for (std::size_t i = 0; i < config.components.size(); ++i) {
    for (const auto& port : probed.components[i].ports) {
      config.components[i].remap[port.name] = {prefix + port.topic, {"camvox inspect", 0}};
    }
  }
  const auto reader = storage::BagReader::open(bag);
  if (!reader.ok()) throw CommandError(reader.status().message());
  for (std::size_t i = 0; i < config.components.size(); ++i) {
    auto& component = config.components[i];
    if (component.plugin != kReplay) continue;
    const auto own = probed.components[i].value<std::vector<std::string>>("remap");
    std::vector<std::string> rules;
    for (const auto& topic : (*reader)->topics()) {
      rules.push_back(topic.name + ":=" + prefix + replayed_as(topic.name, own));
    }
    component.parameters["remap"] = given(rules);
  }
}

CheckedConfig make_config(const InspectOptions& options,
                          const fs::path& picture,
                          PluginLoader& plugins) {
  const auto name = options.config.empty() ? config_for(options.bag) : options.config;
  auto [config, problems] = read_config_file(find_config(name), options.overrides);
  config = reduced(std::move(config), options, picture);
  auto probed = probe_system(config, plugins);
  problems.insert(problems.end(), probed.problems.begin(), probed.problems.end());
  sort_problems(problems);
  if (!problems.empty()) refuse(problems);
  keep_apart(config, probed, options.bag);
  probed = probe_system(config, plugins);
  if (!probed.problems.empty()) refuse(probed.problems);
  return {std::move(config), std::move(probed)};
}

/// Shows what the drawing component says as the command's own words.
class Announcer final : public Logger {
 public:
  void write(LogLevel level, std::string_view text) override {
    if (level == LogLevel::kInfo) {
      fmt::print("{}\n", text);
    } else {
      fmt::print(stderr, "camvox: {}\n", text);
    }
  }
  [[nodiscard]] bool enabled(LogLevel level) const override { return level >= LogLevel::kInfo; }
};

int inspect_depth(const InspectOptions& options) {
  const fs::path output = options.output;
  if (output.extension() != ".png") throw CommandError(options.output + ": must end in .png");
  // Nothing half, and no older picture in place of one that could not be made.
  const fs::path partial =
      output.parent_path() / fmt::format(".{}.{}.png", output.stem().string(), getpid());
  const auto plugins = std::make_shared<PluginLoader>();
  auto checked = make_config(options, partial, *plugins);
  const auto console = console_loggers(LogLevel::kWarn);
  const int code = run_container(std::move(checked), plugins, [&console](const std::string& name) {
    return name == "depth_overlay" ? std::make_shared<Announcer>() : console(name);
  });
  if (!fs::exists(partial)) return code == Exit::kDone ? Exit::kFailed : code;
  std::error_code error;
  fs::rename(partial, output, error);
  if (error) throw CommandError(options.output + ": " + error.message());
  fmt::print("{}\n", options.output);
  return code;
}

}  // namespace

void add_inspect(CLI::App& app, Action& action) {
  auto* inspect = app.add_subcommand("inspect", "Look at intermediate results of a recording");
  inspect->require_subcommand(1);
  auto options = std::make_shared<InspectOptions>();
  auto* command = inspect->add_subcommand(
      "depth", "Draw a frame's depth over its image: sync, deskew and projection as in a run");
  command->add_option("--bag", options->bag, "The recording")->required();
  command
      ->add_option("--parameters",
                   options->overrides.parameter_files,
                   "rig.yaml: camera, and where the sensors sit")
      ->required()
      ->allow_extra_args(false);
  auto* frame = command->add_option("--frame", options->frame_id, "Frame, from 1 (default: 20)")
                    ->check(above_zero());
  command->add_option("--stamp", options->stamp_s, "Or the frame nearest to this time, in s")
      ->check(above_zero())
      ->excludes(frame);
  command->add_option("-o,--output", options->output, "Picture (default: depth_overlay.png)");
  command->add_option("--config",
                      options->config,
                      "Config of a run whose stages to use (default: by what the recording holds)");
  command->add_option("--set", options->overrides.values, "component.parameter=value, as in `run`")
      ->allow_extra_args(false);
  command->callback([options, &action] {
    if (options->frame_id == 0) options->frame_id = 20;
    action = [options] { return inspect_depth(*options); };
  });
}

}  // namespace camvox::command
