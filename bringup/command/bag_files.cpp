#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "bag.hpp"
#include "camvox/storage/bag_writer.hpp"
#include "camvox/storage/doctor.hpp"
#include "camvox/storage/recover.hpp"
#include "camvox/storage/sink.hpp"
#include "camvox/storage/source.hpp"
#include "progress_bar.hpp"
#include "signals.hpp"

/// Words that work on files alone: recover, doctor, convert.
namespace camvox::command {
namespace {

constexpr int kSomethingLost = 3;  // as the reference tool

std::unique_ptr<storage::Source> open_source(const std::string& path) {
  auto source = storage::FileSource::open(path);
  require_ok(source.status());
  return std::move(*source);
}

int interrupted() {
  fmt::print(stderr, "camvox: interrupted; nothing is left behind\n");
  return Exit::kInterrupted;
}

int recover_file(const std::string& input, const std::string& output) {
  const auto source = open_source(input);
  if (std::filesystem::exists(output)) throw CommandError(output + " exists already");
  auto sink = storage::FileSink::create(output);
  require_ok(sink.status());
  StopSignal stop;
  bool stopped = false;
  const auto result = [&] {
    ProgressBar bar("recover " + input);
    storage::RecoverOptions options;
    options.progress = [&](std::uint64_t done) {
      bar.update(done, source->size());
      stopped = stop.wait(std::chrono::milliseconds(0));
      return !stopped;
    };
    return storage::recover(*source, std::move(*sink), options);
  }();
  for (const auto& problem : result.problems) {
    fmt::print(stderr, "at byte {}: {}\n", problem.offset, problem.status.message());
  }
  if (!result.status.ok()) {
    std::error_code ignored;
    std::filesystem::remove(output, ignored);
    if (stopped) return interrupted();
    throw CommandError(result.status.message());
  }
  fmt::print("{}: {} messages, {} attachments, {} metadata records recovered{}\n",
             output,
             result.statistics.message_count,
             result.statistics.attachment_count,
             result.statistics.metadata_count,
             result.lost ? "; something was lost" : "; nothing was lost");
  if (result.unverified_messages > 0) {
    fmt::print(
        "{} of the messages are from the chunk that was cut off: no checksum vouches for them\n",
        result.unverified_messages);
  }
  return result.lost ? kSomethingLost : Exit::kDone;
}

int examine(const std::string& input) {
  const auto result = storage::doctor(*open_source(input));
  for (const auto& finding : result.findings) {
    fmt::print("{} at byte {}: {}\n",
               finding.severity == storage::Severity::kError ? "error" : "warning",
               finding.offset,
               finding.message);
  }
  fmt::print("{}: {} messages in {} chunks, {}\n",
             input,
             result.statistics.message_count,
             result.statistics.chunk_count,
             result.findings.empty() ? "nothing wrong"
                                     : fmt::format("{} findings", result.findings.size()));
  return result.has_errors() ? Exit::kFailed : Exit::kDone;
}

struct ConvertOptions {
  std::string input;
  std::string output;
  std::string compression = "zstd";
  std::vector<std::string> topics;
  std::uint64_t max_bag_size = 0;
};

/// Copies messages, with a progress bar, until the end or Ctrl-C (false). The numbers are the
/// writer's, by topic of the bag.
bool copy_messages(const storage::BagReader& bag,
                   const ConvertOptions& options,
                   const std::vector<std::size_t>& numbers,
                   storage::BagWriter& writer) {
  StopSignal stop;
  ProgressBar bar("convert " + options.input);
  storage::MessageFilter filter;
  filter.topics = options.topics;
  auto cursor = bag.messages(filter);
  const auto length_ns = static_cast<std::uint64_t>(bag.end_time_ns() - bag.start_time_ns());
  for (const auto* message = cursor.next(); message != nullptr; message = cursor.next()) {
    require_ok(writer.write(numbers[message->topic],
                            message->log_time_ns,
                            message->publish_time_ns,
                            message->data,
                            message->sequence));
    bar.update(static_cast<std::uint64_t>(message->log_time_ns - bag.start_time_ns()), length_ns);
    if (stop.wait(std::chrono::milliseconds(0))) return false;
  }
  const auto read_status = cursor.status();
  require_ok(writer.close());  // what could be read is kept
  require_ok(read_status);
  return true;
}

int convert(const ConvertOptions& options) {
  const auto bag = open_bag(options.input);
  storage::BagWriterOptions writer_options;
  writer_options.mcap.compression = parse_compression(options.compression);
  writer_options.max_file_size = options.max_bag_size;
  writer_options.ros_distro = bag->metadata().ros_distro;
  writer_options.custom_data = bag->metadata().custom_data;
  auto writer = storage::BagWriter::create(options.output, writer_options);
  require_ok(writer.status());
  std::vector<std::size_t> numbers;
  for (auto topic : bag->topics()) {
    const auto number = (*writer)->add_topic(std::move(topic));
    require_ok(number.status());
    numbers.push_back(*number);
  }
  if (!copy_messages(*bag, options, numbers, **writer)) {
    writer->reset();
    std::error_code ignored;
    std::filesystem::remove_all(options.output, ignored);  // it was made here
    return interrupted();
  }
  fmt::print("{}: {} messages\n", options.output, (*writer)->metadata().message_count);
  return Exit::kDone;
}

}  // namespace

void add_bag_recover(CLI::App& bag, Action& action) {
  auto paths = std::make_shared<std::pair<std::string, std::string>>();
  auto* command = bag.add_subcommand("recover", "Save what is whole of a damaged MCAP file");
  command->fallthrough();
  command->add_option("file", paths->first, "MCAP file")->required();
  command->add_option("-o,--output", paths->second, "New file")->required();
  command->footer("Exit code: 0 nothing was lost, 3 something was, 1 nothing could be saved.");
  command->callback(
      [paths, &action] { action = [paths] { return recover_file(paths->first, paths->second); }; });
}

void add_bag_doctor(CLI::App& bag, Action& action) {
  auto path = std::make_shared<std::string>();
  auto* command =
      bag.add_subcommand("doctor", "Check an MCAP file from the first byte to the last");
  command->fallthrough();
  command->add_option("file", *path, "MCAP file")->required();
  command->footer("Exit code: 0 no errors, 1 errors.");
  command->callback([path, &action] { action = [path] { return examine(*path); }; });
}

void add_bag_convert(CLI::App& bag, Action& action) {
  auto options = std::make_shared<ConvertOptions>();
  auto* command =
      bag.add_subcommand("convert", "Write a recording anew: compressed, split, chosen");
  command->fallthrough();
  command->add_option("-i,--input", options->input, "Folder of a bag, or one MCAP file")
      ->required();
  command->add_option("-o,--output", options->output, "Folder of the new bag")->required();
  command->add_option("--compression-format", options->compression, "none, lz4 or zstd (default)")
      ->check(CLI::IsMember({"none", "lz4", "zstd"}));
  command->add_option("--topics", options->topics, "Only these topics");
  command->add_option(
      "-b,--max-bag-size", options->max_bag_size, "Bytes of a file before the next");
  command->callback([options, &action] { action = [options] { return convert(*options); }; });
}

}  // namespace camvox::command
