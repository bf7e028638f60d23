#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <opencv2/core/types.hpp>
#include <vector>

namespace camvox::calibration {

/// The two nearest of many points in the plane. A median tree in the array of the points itself.
class KdTree2 {
 public:
  explicit KdTree2(std::vector<cv::Point2f> points) : points_(std::move(points)) {
    build(0, points_.size(), 0);
  }

  /// Distances to the nearest and the second nearest; infinite if there are fewer.
  [[nodiscard]] std::array<float, 2> two_nearest(const cv::Point2f& query) const {
    std::array<float, 2> best = {std::numeric_limits<float>::infinity(),
                                 std::numeric_limits<float>::infinity()};
    visit(query, 0, points_.size(), 0, best);
    return {std::sqrt(best[0]), std::sqrt(best[1])};
  }

 private:
  static float coordinate(const cv::Point2f& point, int axis) {
    return axis == 0 ? point.x : point.y;
  }
  void build(std::size_t begin, std::size_t end, int axis) {
    if (end - begin < 2) return;
    const std::size_t middle = (begin + end) / 2;
    const auto at = [&](std::size_t i) { return points_.begin() + static_cast<std::ptrdiff_t>(i); };
    std::nth_element(at(begin), at(middle), at(end), [axis](const auto& a, const auto& b) {
      return coordinate(a, axis) < coordinate(b, axis);
    });
    build(begin, middle, 1 - axis);
    build(middle + 1, end, 1 - axis);
  }
  void visit(const cv::Point2f& query,
             std::size_t begin,
             std::size_t end,
             int axis,
             std::array<float, 2>& best) const {
    if (begin >= end) return;
    const std::size_t middle = (begin + end) / 2;
    const cv::Point2f d = points_[middle] - query;
    const float distance2 = d.x * d.x + d.y * d.y;
    if (distance2 < best[0]) {
      best = {distance2, best[0]};
    } else if (distance2 < best[1]) {
      best[1] = distance2;
    }
    const float side = coordinate(query, axis) - coordinate(points_[middle], axis);
    const bool first_low = side < 0.0F;
    first_low ? visit(query, begin, middle, 1 - axis, best)
              : visit(query, middle + 1, end, 1 - axis, best);
    if (side * side >= best[1]) return;
    first_low ? visit(query, middle + 1, end, 1 - axis, best)
              : visit(query, begin, middle, 1 - axis, best);
  }

  std::vector<cv::Point2f> points_;
};

}  // namespace camvox::calibration
