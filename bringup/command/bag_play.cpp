#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cmath>

#include "bag.hpp"
#include "camvox/bringup/parameter_file.hpp"
#include "camvox/recording/replay_component.hpp"
#include "keyboard.hpp"
#include "single_component.hpp"

namespace camvox::command {
namespace {

using namespace std::chrono_literals;
constexpr auto kRefresh = 100ms;
constexpr double kRateStep = 0.1;
constexpr int kBarWidth = 30;

struct PlayOptions {
  std::string path;
  double rate = 1.0;
  std::vector<std::string> topics;
  std::vector<std::string> remap;
  bool loop = false;
  double clock_hz = 0.0;
  double delay_s = 0.0;
  double start_offset_s = 0.0;
  bool start_paused = false;
  bool no_keyboard = false;
  std::int64_t read_ahead_mb = 256;
  std::int64_t read_ahead_queue_size = 0;
  std::string qos_overrides;
  std::string storage_config;
  std::optional<std::int64_t> ack_timeout_ms;
  bool no_loans = false;
  std::string log_level = "info";
};

config::ParameterMap to_parameters(const PlayOptions& options) {
  config::ParameterMap parameters;
  const auto set = [&parameters](const std::string& key, config::Value value) {
    parameters[key] = from_command_line(std::move(value));
  };
  set("bag", options.path);
  set("rate", options.rate);
  set("topics", options.topics);
  set("remap", options.remap);
  set("loop", options.loop);
  set("clock_hz", options.clock_hz);
  set("start_offset_s", options.start_offset_s);
  // The publishers exist during the delay, so that subscribers find them before it starts.
  set("paused", options.start_paused || options.delay_s > 0.0);
  set("read_ahead_mb", options.read_ahead_mb);
  set("read_ahead_messages", options.read_ahead_queue_size);
  set("qos_overrides", options.qos_overrides);
  return parameters;
}

void on_key(Key key, recording::Player& player) {
  const double rate = player.state().rate;
  if (key == Key::kSpace) player.toggle_paused();
  if (key == Key::kRight) player.play_next();
  if (key == Key::kUp) player.set_rate(rate + kRateStep);
  if (key == Key::kDown) player.set_rate(rate - kRateStep);
}

/// One line that is written over and over; for a terminal only.
void print_progress(const recording::Player& player) {
  const auto state = player.state();
  const auto& bag = player.bag();
  const double length_s = 1e-9 * static_cast<double>(bag.end_time_ns() - bag.start_time_ns());
  const double done_s = 1e-9 * static_cast<double>(state.position_ns - bag.start_time_ns());
  const double share = length_s > 0.0 ? std::clamp(done_s / length_s, 0.0, 1.0) : 1.0;
  const int filled = static_cast<int>(std::lround(share * kBarWidth));
  fmt::print("\r[{:<{}}] {:.1f} of {:.1f} s, rate {:.1f}, {} messages{}\033[K",
             std::string(static_cast<std::size_t>(filled), '#'),
             kBarWidth,
             std::max(0.0, done_s),
             length_s,
             state.rate,
             state.sent,
             state.paused ? ", paused" : "");
  std::fflush(stdout);
}

/// Plays until the end, Ctrl-C, or an error of the component.
void play_to_end(SingleComponent& component, ReplayComponent& replay, bool keyboard) {
  auto& player = replay.player();
  std::unique_ptr<Keyboard> keys;
  if (keyboard) keys = std::make_unique<Keyboard>([&player](Key key) { on_key(key, player); });
  if (keys && keys->active()) {
    fmt::print("SPACE pause, RIGHT next message, UP/DOWN rate +/-10 %, Ctrl-C end\n");
  }
  const bool terminal = isatty(STDOUT_FILENO) == 1;
  while (!player.state().finished && !component.stop_signal().wait(kRefresh)) {
    if (terminal) print_progress(player);
  }
  if (terminal) {
    print_progress(player);
    fmt::print("\n");
  }
}

/// The file must be one, but nothing in it matters: reading MCAP has no options.
void check_storage_config(const std::string& path) {
  if (path.empty()) return;
  std::vector<config::Problem> problems;
  const auto parameters = bringup::read_parameter_file(path, problems);
  if (!problems.empty()) throw config::ConfigError(std::move(problems));
  for (const auto& entry : parameters) {
    fmt::print(stderr,
               "camvox: warning: {}: {} has no effect on reading MCAP\n",
               entry.second.location.to_string(),
               entry.first);
  }
}

/// Waits as --wait-for-all-acked says, or until Ctrl-C; 0 ms is for ever.
void wait_for_all_acked(SingleComponent& component,
                        const ReplayComponent& replay,
                        std::chrono::milliseconds timeout) {
  for (const auto& topic : replay.best_effort_topics()) {
    fmt::print(stderr, "camvox: warning: {} is best effort: nobody acknowledges it\n", topic);
  }
  const auto end = std::chrono::steady_clock::now() + timeout;
  while (!replay.wait_for_acknowledgments(kRefresh)) {
    if (component.stop_signal().wait(0ms)) return;
    if (timeout > 0ms && std::chrono::steady_clock::now() >= end) {
      fmt::print(stderr, "camvox: warning: not all messages were acknowledged in time\n");
      return;
    }
  }
}

int play(const PlayOptions& options, const CommonOptions& common) {
  check_storage_config(options.storage_config);
  (void)open_bag(options.path);  // an error or a warning before anything else happens
  const Session session(common);
  SingleComponent component(session,
                            "rosbag2_player",
                            to_parameters(options),
                            bringup::parse_log_level(options.log_level));
  ReplayComponent replay(component.context());
  replay.start();
  component.activate([] {});
  if (options.delay_s > 0.0) {
    const auto delay = std::chrono::milliseconds(std::lround(1e3 * options.delay_s));
    if (component.stop_signal().wait(delay)) return Exit::kDone;
    replay.player().set_paused(options.start_paused);
  }
  play_to_end(component, replay, !options.no_keyboard);
  if (options.ack_timeout_ms && replay.player().state().finished) {
    wait_for_all_acked(component, replay, std::chrono::milliseconds(*options.ack_timeout_ms));
  }
  replay.player().stop();
  component.finish();
  const auto state = replay.player().state();
  require_ok(state.status);
  if (state.refused > 0) {
    fmt::print(stderr,
               "camvox: warning: {} messages were not sent, the first because of {}\n",
               state.refused,
               state.refusal);
  }
  fmt::print("{} messages sent\n", state.sent);
  return Exit::kDone;
}

void add_tuning(CLI::App& command, PlayOptions& options) {
  command
      .add_option("--read-ahead-queue-size",
                  options.read_ahead_queue_size,
                  "Bound of what is read ahead, messages (default: none)")
      ->check(CLI::PositiveNumber);
  command
      .add_option("--qos-profile-overrides-path",
                  options.qos_overrides,
                  "YAML file of QoS by topic; wins over what was recorded")
      ->check(CLI::ExistingFile);
  command
      .add_option("--storage-config-file",
                  options.storage_config,
                  "YAML file for the storage; reading MCAP has no options")
      ->check(CLI::ExistingFile);
  command
      .add_option("--wait-for-all-acked",
                  options.ack_timeout_ms,
                  "At the end, wait this long for reliable readers, ms (0: for ever)")
      ->check(CLI::NonNegativeNumber);
  command.add_flag("--disable-loan-message", options.no_loans, "Has no effect: bytes need no loan");
  command
      .add_option("--log-level", options.log_level, "debug, info (default), warn, error or fatal")
      ->check(CLI::IsMember({"debug", "info", "warn", "error", "fatal"}));
}

}  // namespace

void add_bag_play(CLI::App& bag, const CommonOptions& common, Action& action) {
  auto options = std::make_shared<PlayOptions>();
  auto* command = bag.add_subcommand("play", "Publish a recording on its topics");
  command->fallthrough();
  command->add_option("bag", options->path, "Folder of a bag, or one MCAP file")->required();
  command->add_option("-r,--rate", options->rate, "Speed; 2 is twice as fast as recorded")
      ->check(CLI::PositiveNumber);
  command->add_option("--topics", options->topics, "Only these topics");
  command->add_option("-m,--remap", options->remap, "from:=to, another name for a topic");
  command->add_flag("-l,--loop", options->loop, "Start again at the end");
  command
      ->add_option(
          "--clock", options->clock_hz, "Publish /clock this often, Hz (40 without a value)")
      ->expected(0, 1)
      ->default_str("40");
  command->add_option("-d,--delay", options->delay_s, "Wait this long before the first message, s")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--start-offset", options->start_offset_s, "Leave out the first part, s")
      ->check(CLI::NonNegativeNumber);
  command->add_flag("-p,--start-paused", options->start_paused, "Wait for SPACE");
  command->add_flag("--disable-keyboard-controls", options->no_keyboard, "No keys");
  command->add_option("--read-ahead-mb", options->read_ahead_mb, "Bound of what is read ahead, MiB")
      ->check(CLI::Range(1, 65536));
  add_tuning(*command, *options);
  command->callback([options, &common, &action] {
    action = [options, &common] { return play(*options, common); };
  });
}

}  // namespace camvox::command
