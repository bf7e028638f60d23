#include "run_results.hpp"

#include <fmt/format.h>

#include <charconv>
#include <fstream>
#include <sstream>

#include "command.hpp"

namespace camvox::command {
namespace {

/// The cells of all lines but the head; each line must have `columns`.
std::vector<std::vector<std::string>> read_csv(const std::filesystem::path& file,
                                               std::size_t columns) {
  std::istringstream stream(read_file(file));
  std::vector<std::vector<std::string>> rows;
  std::string line;
  std::getline(stream, line);
  for (int number = 2; std::getline(stream, line); ++number) {
    std::vector<std::string> cells;
    std::istringstream text(line);
    for (std::string cell; std::getline(text, cell, ',');) cells.push_back(cell);
    if (cells.size() != columns) {
      throw CommandError(fmt::format("{}:{}: not a line of such a file", file.string(), number));
    }
    rows.push_back(std::move(cells));
  }
  return rows;
}

template <typename T>
T number(const std::string& text, const std::filesystem::path& file) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) {
    throw CommandError(fmt::format("{}: '{}' is not a number", file.string(), text));
  }
  return value;
}

}  // namespace

std::string read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw CommandError(file.string() + ": cannot be read");
  }
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<FrameRow> read_frames(const std::filesystem::path& folder) {
  const auto file = folder / "frames.csv";
  std::vector<FrameRow> rows;
  for (const auto& cells : read_csv(file, 10)) {
    rows.push_back({number<std::int64_t>(cells[1], file),
                    cells[2],
                    number<double>(cells[5], file),
                    number<double>(cells[6], file),
                    number<double>(cells[7], file),
                    number<double>(cells[8], file)});
  }
  return rows;
}

std::vector<TimingRow> read_timing(const std::filesystem::path& folder) {
  std::vector<TimingRow> rows;
  for (auto& cells : read_csv(folder / "timing.csv", 7)) {
    rows.push_back({cells[0], {cells.begin() + 1, cells.end()}});
  }
  return rows;
}

}  // namespace camvox::command
