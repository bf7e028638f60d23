#include "report_page.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <string_view>

namespace camvox::command {
namespace {

using trajectory::escaped;

constexpr std::string_view kStyle = R"(
body { font: 15px/1.5 system-ui, sans-serif; color: #222; max-width: 1100px; margin: 2em auto;
       padding: 0 1em; }
h1 { font-size: 1.6em; } h2 { font-size: 1.2em; margin-top: 2em; border-bottom: 1px solid #ddd; }
table { border-collapse: collapse; margin: 1em 0; } td, th { padding: .25em .8em; text-align: right;
       border-bottom: 1px solid #eee; font-variant-numeric: tabular-nums; }
td:first-child, th:first-child { text-align: left; }
.facts { display: flex; flex-wrap: wrap; gap: 1em; }
.facts div { background: #f4f6f8; border-radius: 6px; padding: .6em 1.2em; }
.facts b { display: block; font-size: 1.4em; }
figure { margin: 1em 0; } img, svg { max-width: 100%; height: auto; }
figcaption { color: #666; font-size: .9em; }
pre { background: #f4f6f8; padding: 1em; overflow: auto; font-size: .85em; }
)";

std::string base64(std::string_view bytes) {
  static constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k) {
      group = (group << 8) | (k < count ? static_cast<std::uint8_t>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= count ? kLetters[(group >> (18 - 6 * k)) & 63U] : '=';
    }
  }
  return text;
}

}  // namespace

ReportPage::ReportPage(std::string title) : title_(std::move(title)) {}

void ReportPage::heading(const std::string& text) {
  body_ += fmt::format("<h2>{}</h2>\n", escaped(text));
}

void ReportPage::paragraph(const std::string& text) {
  body_ += fmt::format("<p>{}</p>\n", escaped(text));
}

void ReportPage::facts(const std::vector<std::pair<std::string, std::string>>& facts) {
  body_ += "<div class=\"facts\">";
  for (const auto& [name, value] : facts) {
    body_ += fmt::format("<div>{}<b>{}</b></div>", escaped(name), escaped(value));
  }
  body_ += "</div>\n";
}

void ReportPage::table(const std::vector<std::vector<std::string>>& rows) {
  body_ += "<table>\n";
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto* cell = i == 0 ? "th" : "td";
    body_ += "<tr>";
    for (const auto& text : rows[i]) body_ += fmt::format("<{0}>{1}</{0}>", cell, escaped(text));
    body_ += "</tr>\n";
  }
  body_ += "</table>\n";
}

void ReportPage::chart(const trajectory::Chart& chart) {
  body_ += "<figure>" + trajectory::to_svg(chart) + "</figure>\n";
}

void ReportPage::picture(const std::string& png, const std::string& caption) {
  body_ += fmt::format(
      "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption>"
      "</figure>\n",
      escaped(caption),
      base64(png));
}

void ReportPage::details(const std::string& summary, const std::string& text) {
  body_ += fmt::format(
      "<details><summary>{}</summary><pre>{}</pre></details>\n", escaped(summary), escaped(text));
}

std::string ReportPage::html() const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\">\n<title>{0}</title>\n"
      "<style>{1}</style></head>\n<body><h1>{0}</h1>\n{2}</body></html>\n",
      escaped(title_),
      kStyle,
      body_);
}

}  // namespace camvox::command
