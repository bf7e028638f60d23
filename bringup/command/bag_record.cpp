#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <ctime>

#include "bag.hpp"
#include "camvox/recording/record_component.hpp"
#include "single_component.hpp"

namespace camvox::command {
namespace {

struct RecordOptions {
  std::string output;
  std::string storage = "mcap";
  std::vector<std::string> topics;
  std::vector<std::string> more_topics;  // of --topics
  bool all = false;
  std::vector<std::string> exclude;
  std::string regex;
  std::string exclude_regex;
  std::string compression = "none";
  double max_bag_size = 0.0;      // bytes, as ros2 bag
  double max_bag_duration = 0.0;  // s
  std::int64_t max_cache_size = std::int64_t{256} << 20;
  std::int64_t polling_interval_ms = 100;
  std::string qos_overrides;
};

std::string default_output() {
  return fmt::format("rosbag2_{:%Y_%m_%d-%H_%M_%S}", fmt::localtime(std::time(nullptr)));
}

config::ParameterMap to_parameters(const RecordOptions& options) {
  config::ParameterMap parameters;
  const auto set = [&parameters](const std::string& key, config::Value value) {
    parameters[key] = from_command_line(std::move(value));
  };
  set("output", options.output);
  set("topics", options.topics);
  set("exclude", options.exclude);
  set("regex", options.regex);
  set("exclude_regex", options.exclude_regex);
  set("compression", options.compression);
  set("max_bag_size_mb", options.max_bag_size * 1e-6);
  set("max_bag_duration_s", options.max_bag_duration);
  set("max_cache_mb", std::max<std::int64_t>(1, options.max_cache_size >> 20));
  set("polling_interval_s", 1e-3 * static_cast<double>(options.polling_interval_ms));
  set("qos_overrides", options.qos_overrides);
  return parameters;
}

int record(RecordOptions options, const CommonOptions& common) {
  options.topics.insert(
      options.topics.end(), options.more_topics.begin(), options.more_topics.end());
  if (options.topics.empty() && options.regex.empty() && !options.all) {
    throw CommandError("name the topics to record, or --all, or --regex");
  }
  if (options.all) options.topics.clear();
  if (options.output.empty()) options.output = default_output();
  const Session session(common);
  SingleComponent component(session, "rosbag2_recorder", to_parameters(options));
  RecordComponent recorder(component.context());
  component.activate([&recorder] { recorder.start(); });
  fmt::print("recording to {}; Ctrl-C ends it\n", options.output);
  std::fflush(stdout);
  component.stop_signal().wait();
  component.finish();
  const std::uint64_t lost = recorder.lost();
  require_ok(recorder.finish());
  const auto state = recorder.state();
  fmt::print("{}: {} messages, {}, {} lost\n",
             options.output,
             state.written,
             format_size(state.written_bytes),
             lost);
  return lost == 0 ? Exit::kDone : Exit::kFailed;
}

}  // namespace

void add_bag_record(CLI::App& bag, const CommonOptions& common, Action& action) {
  auto options = std::make_shared<RecordOptions>();
  auto* command = bag.add_subcommand("record", "Record topics to MCAP until Ctrl-C");
  command->fallthrough();
  command->add_option("topic", options->topics, "Topics to record");
  command->add_option("--topics", options->more_topics, "Topics to record");
  command->add_flag("-a,--all", options->all, "All topics, also those that appear later");
  command->add_option("-o,--output", options->output, "Folder to make (default: rosbag2_<date>)");
  command->add_option("-s,--storage", options->storage, "mcap")->check(CLI::IsMember({"mcap"}));
  command->add_option("-e,--regex", options->regex, "Also topics whose whole name matches");
  command->add_option(
      "-x,--exclude-regex", options->exclude_regex, "Not topics whose name matches");
  command->add_option("--exclude-topics", options->exclude, "Not these topics");
  command->add_option("-b,--max-bag-size", options->max_bag_size, "Bytes of a file before the next")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option(
          "-d,--max-bag-duration", options->max_bag_duration, "Seconds of a file before the next")
      ->check(CLI::NonNegativeNumber);
  command
      ->add_option("--max-cache-size", options->max_cache_size, "Bytes that may wait for the disk")
      ->check(CLI::PositiveNumber);
  command->add_option("--compression-format", options->compression, "none (default), lz4 or zstd")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}));
  command
      ->add_option(
          "-p,--polling-interval", options->polling_interval_ms, "How often to look for topics, ms")
      ->check(CLI::Range(10, 60'000));
  command
      ->add_option("--qos-profile-overrides-path",
                   options->qos_overrides,
                   "YAML file of the QoS to subscribe with, by topic")
      ->check(CLI::ExistingFile);
  command->footer("Exit code: 0 all recorded, 1 something was lost or the disk failed.");
  command->callback([options, &common, &action] {
    action = [options, &common] { return record(*options, common); };
  });
}

}  // namespace camvox::command
