#include "import_report_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <vector>

namespace camvox::command {
namespace {

using Row = std::array<std::string, 4>;

/// Columns as wide as their longest cell; the second and third are numbers.
std::string table(const std::vector<Row>& rows) {
  std::array<std::size_t, 4> widths{};
  for (const auto& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  std::string text;
  for (const auto& row : rows) {
    text += fmt::format("  {:<{}}  {:>{}}  {:>{}}  {}\n",
                        row[0],
                        widths[0],
                        row[1],
                        widths[1],
                        row[2],
                        widths[2],
                        row[3]);
  }
  return text;
}

std::string rate_text(const import::WrittenTopic& topic) {
  const double span_s = 1e-9 * static_cast<double>(topic.last_time_ns - topic.first_time_ns);
  if (topic.message_count < 2 || span_s <= 0.0) return "-";
  return fmt::format("{:.2f}", static_cast<double>(topic.message_count - 1) / span_s);
}

std::uint64_t size_of_bag(const std::filesystem::path& bag) {
  std::uint64_t size = 0;
  for (const auto& entry : std::filesystem::directory_iterator(bag)) size += entry.file_size();
  return size;
}

void append_list(std::string& text, const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return;
  text += fmt::format("{}:\n", title);
  for (const auto& line : lines) text += fmt::format("  {}\n", line);
}

}  // namespace

std::string report_text(const import::ImportReport& report) {
  std::vector<Row> rows = {{"topic", "messages", "Hz", "type"}};
  std::uint64_t messages = 0;
  auto first_ns = report.topics.front().first_time_ns;
  auto last_ns = report.topics.front().last_time_ns;
  for (const auto& topic : report.topics) {
    rows.push_back({topic.name, std::to_string(topic.message_count), rate_text(topic), topic.type});
    messages += topic.message_count;
    first_ns = std::min(first_ns, topic.first_time_ns);
    last_ns = std::max(last_ns, topic.last_time_ns);
  }
  auto text = fmt::format("{}: {} messages, {:.3f} s, {:.1f} MB\n",
                          report.bag.string(),
                          messages,
                          1e-9 * static_cast<double>(last_ns - first_ns),
                          1e-6 * static_cast<double>(size_of_bag(report.bag)));
  text += table(rows);
  if (!report.left_out.empty()) text += "left out:\n";
  for (const auto& item : report.left_out) {
    text += fmt::format("  {} ({}): {}\n", item.what, item.count, item.why);
  }
  append_list(text, "missing", report.missing);
  append_list(text, "notes", report.notes);
  return text;
}

}  // namespace camvox::command
