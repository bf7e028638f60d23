#include <fmt/chrono.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>

#include "bag.hpp"

namespace camvox::command {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

std::string format_seconds(std::int64_t time_ns) {
  return fmt::format("{}.{:09d}", time_ns / kSecond_ns, time_ns % kSecond_ns);
}

/// "Nov 22 2026 05:13:22.123456789 (1795324402.123456789)", in local time as `ros2 bag info`.
std::string format_date(std::int64_t time_ns) {
  const auto date = fmt::localtime(static_cast<std::time_t>(time_ns / kSecond_ns));
  return fmt::format(
      "{:%b %d %Y %H:%M:%S}.{:09d} ({})", date, time_ns % kSecond_ns, format_seconds(time_ns));
}

void print_line(const std::string& label, const std::string& text) {
  fmt::print("{:<19}{}\n", label, text);
}

void print_info(const storage::BagReader& bag) {
  std::string label = "Files:";
  for (const auto& file : bag.files()) {
    print_line(std::exchange(label, ""), file.filename().string());
  }
  print_line("Bag size:", format_size(bag.size()));
  print_line("Storage id:", bag.metadata().storage_identifier);
  const auto& distro = bag.metadata().ros_distro;
  print_line("ROS Distro:", distro.empty() ? "unknown" : distro);
  print_line("Duration:", format_seconds(bag.end_time_ns() - bag.start_time_ns()) + "s");
  print_line("Start:", format_date(bag.start_time_ns()));
  print_line("End:", format_date(bag.end_time_ns()));
  print_line("Messages:", std::to_string(bag.message_count()));
  label = "Topic information:";
  for (const auto& topic : bag.topics()) {
    print_line(std::exchange(label, ""),
               fmt::format("Topic: {} | Type: {} | Count: {} | Serialization Format: {}",
                           topic.name,
                           topic.type,
                           topic.message_count,
                           topic.serialization_format));
  }
}

}  // namespace

void add_bag_info(CLI::App& bag, Action& action) {
  struct Options {
    std::string path;
    bool names_only = false;
  };
  auto options = std::make_shared<Options>();
  auto* command = bag.add_subcommand("info", "Say what is in a recording");
  command->fallthrough();
  command->add_option("bag", options->path, "Folder of a bag, or one MCAP file")->required();
  command->add_flag("-t,--topic-name", options->names_only, "Only the names of its topics");
  command->callback([options, &action] {
    action = [options] {
      const auto reader = open_bag(options->path);
      if (!options->names_only) print_info(*reader);
      for (const auto& topic : reader->topics()) {
        if (options->names_only) fmt::print("{}\n", topic.name);
      }
      return Exit::kDone;
    };
  });
}

}  // namespace camvox::command
