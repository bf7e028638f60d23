#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

namespace camvox::trajectory {

/// One line of a chart.
struct Series {
  std::string name;   ///< In the legend; none when empty.
  std::string color;  ///< Of CSS: "#1f77b4".
  std::vector<std::array<double, 2>> points;
};

/// A chart of lines as a whole SVG, to be shown by a browser or put into a page.
struct Chart {
  std::string title;
  std::string x_label;
  std::string y_label;
  std::vector<Series> series;
  bool equal_scales = false;  ///< One metre is as long in x as in y: maps.
  int width_px = 760;
  int height_px = 420;
};

/// Text as it stands in XML and HTML: < > & are spelled out.
[[nodiscard]] std::string escaped(std::string_view text);

/// Draws `chart`. Points that are not finite leave gaps. Long lines are thinned to what can be
/// seen.
[[nodiscard]] std::string to_svg(const Chart& chart);

}  // namespace camvox::trajectory
