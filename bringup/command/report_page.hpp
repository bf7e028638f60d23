#pragma once

#include <string>
#include <utility>
#include <vector>

#include "camvox/trajectory/chart.hpp"

namespace camvox::command {

/// A page that needs nothing but itself: charts as SVG, pictures inside.
class ReportPage {
 public:
  explicit ReportPage(std::string title);

  void heading(const std::string& text);
  void paragraph(const std::string& text);
  /// Short facts in large letters, side by side: {"APE rmse", "0.12 m"}.
  void facts(const std::vector<std::pair<std::string, std::string>>& facts);
  /// A table; the first row is its head. Cells of one column are right-aligned from the second on.
  void table(const std::vector<std::vector<std::string>>& rows);
  void chart(const trajectory::Chart& chart);
  /// A PNG, already read.
  void picture(const std::string& png, const std::string& caption);
  /// Text as it is, behind a line to click on.
  void details(const std::string& summary, const std::string& text);

  [[nodiscard]] std::string html() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace camvox::command
