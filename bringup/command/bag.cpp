#include "bag.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>

namespace camvox::command {

std::unique_ptr<storage::BagReader> open_bag(const std::string& path) {
  auto bag = storage::BagReader::open(path);
  require_ok(bag.status());
  for (const auto& problem : (*bag)->problems()) {
    fmt::print(stderr, "camvox: warning: {}\n", problem.status.message());
  }
  return std::move(*bag);
}

void require_ok(const storage::Status& status) {
  if (!status.ok()) throw CommandError(status.message());
}

storage::Compression parse_compression(const std::string& name) {
  if (name == "lz4") return storage::Compression::kLz4;
  if (name == "zstd") return storage::Compression::kZstd;
  return storage::Compression::kNone;
}

std::string format_size(std::uint64_t bytes) {
  static constexpr std::array<const char*, 4> kUnits = {"B", "KiB", "MiB", "GiB"};
  auto size = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; size >= 1024.0 && unit + 1 < kUnits.size(); ++unit) size /= 1024.0;
  return unit == 0 ? fmt::format("{} B", bytes) : fmt::format("{:.1f} {}", size, kUnits[unit]);
}

void add_bag(CLI::App& app, const CommonOptions& common, Action& action) {
  auto* bag = app.add_subcommand("bag", "Record, replay and look after MCAP recordings");
  bag->require_subcommand(1);
  bag->fallthrough();
  add_bag_record(*bag, common, action);
  add_bag_play(*bag, common, action);
  add_bag_info(*bag, action);
  add_bag_recover(*bag, action);
  add_bag_doctor(*bag, action);
  add_bag_convert(*bag, action);
}

}  // namespace camvox::command
