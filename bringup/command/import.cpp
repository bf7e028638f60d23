#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <sstream>

#include "camvox/import/kitti_raw.hpp"
#include "camvox/import/livox_csv.hpp"
#include "camvox/import/rosbag1.hpp"
#include "camvox/import/seven_scenes.hpp"
#include "camvox/import/tum_rgbd.hpp"
#include "command.hpp"
#include "import_report_text.hpp"
#include "progress_bar.hpp"
#include "signals.hpp"

namespace camvox::command {
namespace {

/// Words that all importers share.
struct Common {
  std::string input;
  std::string output;
  std::string compression = "none";
  std::uint64_t max_bag_size = 0;
};

using Importer =
    std::function<storage::Result<import::ImportReport>(const std::filesystem::path& input)>;

/// Sets the common options, shows progress, prints the report.
int run_import(const Common& common, import::ImportOptions& options, const Importer& importer) {
  options.output = common.output;
  options.bag.mcap.compression = common.compression == "none"
                                     ? storage::Compression::kNone
                                     : storage::parse_compression(common.compression).value();
  options.bag.max_file_size = common.max_bag_size;
  StopSignal stop;
  bool stopped = false;
  auto result = [&] {
    ProgressBar bar("import " + common.input);
    options.progress = [&](const import::ImportProgress& progress) {
      bar.update(progress.done, progress.total);
      stopped = stop.wait(std::chrono::milliseconds(0));
      return !stopped;
    };
    return importer(common.input);
  }();
  if (stopped) {
    fmt::print(stderr, "camvox: {}\n", result.status().message());
    return Exit::kInterrupted;
  }
  if (!result.ok()) throw CommandError(result.status().message());
  fmt::print("{}", report_text(*result));
  return Exit::kDone;
}

/// Adds one importer; `function(input, options)` runs it.
template <typename Options, typename Function>
std::pair<CLI::App*, std::shared_ptr<Options>> add(
    CLI::App& group, const char* word, const char* help, Action& action, Function function) {
  auto common = std::make_shared<Common>();
  auto options = std::make_shared<Options>();
  auto* command = group.add_subcommand(word, help);
  command->fallthrough();
  command->add_option("input", common->input, "Folder or file of the recording")->required();
  command->add_option("-o,--output",
                      common->output,
                      "Folder of the bag; must not exist (default: named after INPUT)");
  command->add_option("--compression", common->compression, "none, lz4 or zstd (default: none)")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}));
  command->add_option("-b,--max-bag-size",
                      common->max_bag_size,
                      "Start a new file after this many bytes (default: 0, never)");
  command->callback([&action, common, options, function] {
    action = [common, options, function] {
      return run_import(
          *common, *options, [&](const auto& input) { return function(input, *options); });
    };
  });
  return {command, options};
}

void add_kitti_raw(CLI::App& group, Action& action) {
  auto [command, options] = add<import::KittiRawOptions>(
      group,
      "kitti-raw",
      "KITTI raw, synced: camera, Velodyne, OXTS and calibration; the date's or a drive's folder",
      action,
      import::import_kitti_raw);
  command->add_option("--drive", options->drive, "Folder of the drive, if the date has several");
  command->add_option("--camera", options->camera, "0, 1: grey; 2, 3: colour (default: 2)")
      ->check(CLI::Range(0, 3));
}

/// "517.3,516.5,318.6,255.3" with up to five numbers of distortion, or the name of a camera.
std::array<double, 9> parse_intrinsics(const std::string& text) {
  if (const auto known = import::tum_intrinsics(text)) return *known;
  std::array<double, 9> values{};
  std::size_t count = 0;
  std::istringstream stream(text);
  for (std::string word; std::getline(stream, word, ','); ++count) {
    const bool good = count < values.size() && CLI::detail::lexical_cast(word, values[count]);
    if (!good) count = values.size();  // and one more: refused below
  }
  if (count < 4 || count > values.size()) {
    throw CLI::ValidationError("--intrinsics",
                               "'" + text +
                                   "' is neither fr1, fr2, fr3, icl nor "
                                   "fx,fy,cx,cy[,k1,k2,p1,p2,k3]");
  }
  return values;
}

void add_tum_rgbd(CLI::App& group, Action& action) {
  auto [command, options] = add<import::TumRgbdOptions>(
      group,
      "tum-rgbd",
      "A sequence of the TUM RGB-D benchmark, or of ICL-NUIM in its form",
      action,
      import::import_tum_rgbd);
  command->add_option_function<std::string>(
      "--intrinsics",
      [chosen = options](const std::string& text) { chosen->intrinsics = parse_intrinsics(text); },
      "fr1, fr2, fr3, icl, or fx,fy,cx,cy[,k1,k2,p1,p2,k3] (default: by the folder's name)");
  command->add_option(
      "--depth-factor", options->depth_units_per_m, "Units a metre (default: 5000)");
  command->add_option(
      "--rate", options->index_rate_hz, "Frames a second of ICL-NUIM (default: 30)");
}

void add_seven_scenes(CLI::App& group, Action& action) {
  auto [command, options] = add<import::SevenScenesOptions>(
      group,
      "7scenes",
      "A 7-Scenes sequence; depth is registered to the colour camera",
      action,
      import::import_seven_scenes);
  command
      ->add_option("--offset",
                   options->rig.p_camera_depth_m,
                   "Depth camera in the colour camera's optical frame, m (default: -0.025 0 0)")
      ->expected(3);
  command->add_option("--rate", options->frame_rate_hz, "Frames a second (default: 30)");
}

void add_livox_csv(CLI::App& group, Action& action) {
  auto [command, options] = add<import::LivoxCsvOptions>(group,
                                                         "livox-csv",
                                                         "Points of a Livox lidar in firing order",
                                                         action,
                                                         import::import_livox_csv);
  command->add_option("--topic", options->topic, "Default: /livox/lidar");
  command->add_option("--point-interval",
                      options->point_interval_ns,
                      "ns between points when the file has no times (default: 4167)");
  command->add_option("--lines", options->lines, "Lasers that fire in turn (default: 6)");
}

}  // namespace

void add_import(CLI::App& app, Action& action) {
  auto* group = app.add_subcommand("import", "Make a bag (MCAP) of a public data set's recording");
  group->require_subcommand(1)->fallthrough();
  add_kitti_raw(*group, action);
  add_tum_rgbd(*group, action);
  add_seven_scenes(*group, action);
  add_livox_csv(*group, action);
  add<import::ImportOptions>(*group,
                             "rosbag1",
                             "A ROS 1 bag (format 2.0): the topics whose types camvox has",
                             action,
                             import::import_rosbag1);
}

}  // namespace camvox::command
