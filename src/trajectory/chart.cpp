#include "camvox/trajectory/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace camvox::trajectory {
namespace {

constexpr double kLeft_px = 64.0;
constexpr double kRight_px = 16.0;
constexpr double kTop_px = 34.0;
constexpr double kBottom_px = 46.0;
constexpr int kTicks = 6;

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void add(double value) {
    if (!std::isfinite(value)) return;
    low = std::min(low, value);
    high = std::max(high, value);
  }
  /// Never empty, with a margin of 4 %.
  [[nodiscard]] Range padded() const {
    if (!(low <= high)) return {0.0, 1.0};
    const double span = high > low ? high - low : std::max(1.0, std::abs(low));
    return {low - 0.04 * span, high + 0.04 * span};
  }
  [[nodiscard]] double span() const { return high - low; }
};

/// 1, 2 or 5 times a power of ten, so that about kTicks of them fit.
double tick_step(const Range& range) {
  const double raw = range.span() / kTicks;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * power) return factor * power;
  }
  return 10.0 * power;
}

class Drawing {
 public:
  explicit Drawing(const Chart& chart) : chart_(chart) {
    for (const auto& series : chart.series) {
      for (const auto& [x, y] : series.points) {
        if (!std::isfinite(x) || !std::isfinite(y)) continue;
        x_.add(x);
        y_.add(y);
      }
    }
    x_ = x_.padded();
    y_ = y_.padded();
    if (chart.equal_scales) equalise();
  }

  [[nodiscard]] std::string draw() {
    text_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
        "height=\"{1}\" font-family=\"sans-serif\" font-size=\"12\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n"
        "<text x=\"{2}\" y=\"20\" font-size=\"14\" font-weight=\"bold\">{3}</text>\n",
        chart_.width_px,
        chart_.height_px,
        kLeft_px,
        escaped(chart_.title));
    draw_grid();
    for (const auto& series : chart_.series) draw_line(series);
    draw_legend();
    return text_ + "</svg>\n";
  }

 private:
  [[nodiscard]] double plot_width_px() const { return chart_.width_px - kLeft_px - kRight_px; }
  [[nodiscard]] double plot_height_px() const { return chart_.height_px - kTop_px - kBottom_px; }
  [[nodiscard]] double x_px(double x) const {
    return kLeft_px + (x - x_.low) / x_.span() * plot_width_px();
  }
  [[nodiscard]] double y_px(double y) const {
    return kTop_px + (y_.high - y) / y_.span() * plot_height_px();
  }

  /// Widens one range around its middle.
  void equalise() {
    const double units_per_px = std::max(x_.span() / plot_width_px(), y_.span() / plot_height_px());
    const auto widen = [units_per_px](Range& range, double size_px) {
      const double more = 0.5 * (units_per_px * size_px - range.span());
      range = {range.low - more, range.high + more};
    };
    widen(x_, plot_width_px());
    widen(y_, plot_height_px());
  }

  void draw_grid() {
    const double bottom_px = kTop_px + plot_height_px();
    const double right_px = kLeft_px + plot_width_px();
    const double x_step = tick_step(x_);
    for (double x = std::ceil(x_.low / x_step) * x_step; x <= x_.high; x += x_step) {
      text_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}V{2:.1f}\" stroke=\"#ddd\"/>"
          "<text x=\"{0:.1f}\" y=\"{3:.1f}\" text-anchor=\"middle\">{4:.6g}</text>\n",
          x_px(x),
          kTop_px,
          bottom_px,
          bottom_px + 16.0,
          std::abs(x) < 1e-9 * x_step ? 0.0 : x);
    }
    const double y_step = tick_step(y_);
    for (double y = std::ceil(y_.low / y_step) * y_step; y <= y_.high; y += y_step) {
      text_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}H{2:.1f}\" stroke=\"#ddd\"/>"
          "<text x=\"{3:.1f}\" y=\"{4:.1f}\" text-anchor=\"end\">{5:.6g}</text>\n",
          kLeft_px,
          y_px(y),
          right_px,
          kLeft_px - 6.0,
          y_px(y) + 4.0,
          std::abs(y) < 1e-9 * y_step ? 0.0 : y);
    }
    text_ += fmt::format(
        "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
        "stroke=\"#888\"/>\n<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n"
        "<text transform=\"translate(14 {:.1f}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        kLeft_px,
        kTop_px,
        plot_width_px(),
        plot_height_px(),
        kLeft_px + 0.5 * plot_width_px(),
        bottom_px + 36.0,
        escaped(chart_.x_label),
        kTop_px + 0.5 * plot_height_px(),
        escaped(chart_.y_label));
  }

  void draw_line(const Series& series) {
    std::string path;
    bool pen_down = false;
    double last_x_px = 0.0;
    double last_y_px = 0.0;
    for (std::size_t i = 0; i < series.points.size(); ++i) {
      const auto& [x, y] = series.points[i];
      if (!std::isfinite(x) || !std::isfinite(y)) {
        pen_down = false;
        continue;
      }
      const double u = x_px(x);
      const double v = y_px(y);
      const bool near = std::hypot(u - last_x_px, v - last_y_px) < 0.3;
      if (pen_down && near && i + 1 < series.points.size()) continue;
      path += fmt::format("{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', u, v);
      pen_down = true;
      last_x_px = u;
      last_y_px = v;
    }
    text_ += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\" "
        "stroke-linejoin=\"round\"/>\n",
        path,
        escaped(series.color));
  }

  void draw_legend() {
    double y = kTop_px + 16.0;
    for (const auto& series : chart_.series) {
      if (series.name.empty()) continue;
      text_ += fmt::format(
          "<path d=\"M{0:.1f} {1:.1f}h18\" stroke=\"{2}\" stroke-width=\"3\"/>"
          "<text x=\"{3:.1f}\" y=\"{4:.1f}\">{5}</text>\n",
          kLeft_px + 10.0,
          y - 4.0,
          escaped(series.color),
          kLeft_px + 34.0,
          y,
          escaped(series.name));
      y += 17.0;
    }
  }

  const Chart& chart_;
  Range x_;
  Range y_;
  std::string text_;
};

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string to_svg(const Chart& chart) { return Drawing(chart).draw(); }

}  // namespace camvox::trajectory
