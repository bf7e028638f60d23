#pragma once

#include <memory>
#include <string>

#include "camvox/storage/bag_reader.hpp"
#include "command.hpp"

/// The words of `camvox bag`, with the options of `ros2 bag`. One file a word, or a few.
namespace camvox::command {

void add_bag_info(CLI::App& bag, Action& action);
void add_bag_play(CLI::App& bag, const CommonOptions& common, Action& action);
void add_bag_record(CLI::App& bag, const CommonOptions& common, Action& action);
void add_bag_recover(CLI::App& bag, Action& action);
void add_bag_doctor(CLI::App& bag, Action& action);
void add_bag_convert(CLI::App& bag, Action& action);

/// Opens a bag's folder or one MCAP file; throws CommandError. What is wrong with it but does not
/// keep it from being read is printed on standard error.
[[nodiscard]] std::unique_ptr<storage::BagReader> open_bag(const std::string& path);

/// Throws CommandError if the status is not ok.
void require_ok(const storage::Status& status);

/// "none", "lz4" or "zstd" as the library's value.
[[nodiscard]] storage::Compression parse_compression(const std::string& name);

/// "12.3 MiB".
[[nodiscard]] std::string format_size(std::uint64_t bytes);

}  // namespace camvox::command
