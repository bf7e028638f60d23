#include "camvox/dense/top_view.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace camvox::dense {
namespace {

constexpr double kMargin = 0.005;  // of the points, left out at either end of an axis
constexpr Rgb kPathColour = {255, 40, 40};
constexpr int kPathRadius_px = 1;

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

Interval middle_of(std::vector<float> values) {
  std::sort(values.begin(), values.end());
  const auto skip = static_cast<std::size_t>(kMargin * static_cast<double>(values.size()));
  return {values[skip], values[values.size() - 1 - skip]};
}

class Canvas {
 public:
  Canvas(Interval x, Interval y, int max_size_px) : x_(x), y_(y) {
    const double span_m = std::max({x.high - x.low, y.high - y.low, 1e-3});
    picture_.m_per_px = span_m / (max_size_px - 1);
    picture_.width_px = 1 + static_cast<int>((x.high - x.low) / picture_.m_per_px);
    picture_.height_px = 1 + static_cast<int>((y.high - y.low) / picture_.m_per_px);
    const auto pixels =
        static_cast<std::size_t>(picture_.width_px) * static_cast<std::size_t>(picture_.height_px);
    picture_.rgb.assign(3 * pixels, 0);
    heights_m_.assign(pixels, -std::numeric_limits<float>::infinity());
  }

  void draw(double x, double y, float height_m, const Rgb& rgb) {
    set(column(x), row(y), height_m, rgb);
  }
  void mark(double x, double y) {
    for (int du = -kPathRadius_px; du <= kPathRadius_px; ++du) {
      for (int dv = -kPathRadius_px; dv <= kPathRadius_px; ++dv) {
        set(column(x) + du, row(y) + dv, std::numeric_limits<float>::infinity(), kPathColour);
      }
    }
  }
  [[nodiscard]] Picture take() { return std::move(picture_); }

 private:
  [[nodiscard]] int column(double x) const { return to_px(x - x_.low); }
  [[nodiscard]] int row(double y) const { return to_px(y_.high - y); }
  [[nodiscard]] int to_px(double distance_m) const {
    return static_cast<int>(std::floor(std::clamp(distance_m / picture_.m_per_px, -1e6, 1e6)));
  }
  void set(int u, int v, float height_m, const Rgb& rgb) {
    if (u < 0 || v < 0 || u >= picture_.width_px || v >= picture_.height_px) return;
    const auto pixel = static_cast<std::size_t>(v) * static_cast<std::size_t>(picture_.width_px) +
                       static_cast<std::size_t>(u);
    if (height_m < heights_m_[pixel]) return;
    heights_m_[pixel] = height_m;
    std::copy(
        rgb.begin(), rgb.end(), picture_.rgb.begin() + static_cast<std::ptrdiff_t>(3 * pixel));
  }

  Interval x_;
  Interval y_;
  Picture picture_;
  std::vector<float> heights_m_;
};

}  // namespace

Picture draw_top_view(const std::vector<ColouredPoint>& points_map,
                      const std::vector<Eigen::Vector3d>& path,
                      int max_size_px) {
  if (points_map.empty() || max_size_px < 2) return {};
  const auto along = [&](int axis) {
    std::vector<float> values;
    values.reserve(points_map.size());
    for (const auto& point : points_map) values.push_back(point.p[axis]);
    return middle_of(std::move(values));
  };
  Canvas canvas(along(0), along(1), max_size_px);
  for (const auto& [p, rgb] : points_map) canvas.draw(p.x(), p.y(), p.z(), rgb);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Eigen::Vector3d step = path[i] - path[i - 1];
    const int parts = 1 + static_cast<int>(std::min(step.norm() / 0.05, 1000.0));
    for (int k = 0; k <= parts; ++k) {
      const Eigen::Vector3d p = path[i - 1] + step * k / parts;
      canvas.mark(p.x(), p.y());
    }
  }
  return canvas.take();
}

}  // namespace camvox::dense
