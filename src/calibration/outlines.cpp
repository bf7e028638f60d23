#include "outlines.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>

namespace camvox::calibration {
namespace {

using Eigen::Vector3d;

constexpr double kMaxStep_rad = 0.02;     ///< Neighbours of a line are nearer to each other.
constexpr double kMinJump_m = 0.3;        ///< Beyond what the ratio asks: a step is no outline.
constexpr double kMaxGap = 2.5;           ///< In steps; more, and returns are missing between.
constexpr double kMinApart_rad = 0.0025;  ///< Pieces of an outline are on other lines,
constexpr double kMaxApart_rad = 0.02;    ///< and not far away.
constexpr double kMaxSlope = 0.7;         ///< Along the line, for each radian across.
constexpr double kMaxBend_rad = 0.002;    ///< Residual of the straight piece, rms.
constexpr double kSameRange = 0.1;        ///< Of the range.
constexpr int kMinPieces = 2;

/// Where two neighbours of a scan line lie at different depth.
struct Gap {
  Vector3d f_lidar;  ///< Bearing of its middle.
  Vector3d e_lidar;  ///< Along the scan line, towards what lies behind.
  double range_m;    ///< Of the near side.
};

/// The middle angle between neighbours.
double step_rad_of(const std::vector<Vector3d>& f_lidar) {
  std::vector<double> steps;
  for (std::size_t i = 0; i + 1 < f_lidar.size(); ++i) {
    const double step = (f_lidar[i + 1] - f_lidar[i]).norm();
    if (step < kMaxStep_rad) steps.push_back(step);
  }
  if (steps.empty()) return 0.0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// The cloud as one long line.
struct Line {
  std::vector<Vector3d> f_lidar;
  std::vector<double> range_m;
  double step_rad = 0.0;
  double min_ratio = 1.0;
};

/// The gap between the near return i and the far one at i + way; both surfaces go on.
std::optional<Gap> gap_at(const Line& line, std::size_t i, std::ptrdiff_t way) {
  const auto at = [&](std::ptrdiff_t k) {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) + k * way);
  };
  const std::size_t before = at(-1);
  const std::size_t far = at(1);
  const double jump_m = line.range_m[far] - line.range_m[i];
  if (jump_m < (line.min_ratio - 1.0) * line.range_m[i] + kMinJump_m) return std::nullopt;
  if (std::abs(line.range_m[i] - line.range_m[before]) > 0.2 * jump_m) return std::nullopt;
  if (std::abs(line.range_m[at(2)] - line.range_m[far]) > 0.3 * jump_m) return std::nullopt;
  const Vector3d& f = line.f_lidar[i];
  const Vector3d back = f - line.f_lidar[before];
  if (!(back.norm() > 0.0) || back.norm() > kMaxGap * line.step_rad) return std::nullopt;
  const Vector3d e = (back - back.dot(f) * f).normalized();
  // Lasers that do not sit in the middle see what is far at another height: only the way along
  // the line counts.
  const double gap_rad = (line.f_lidar[far] - f).dot(e);
  if (gap_rad <= 0.0 || gap_rad > kMaxGap * line.step_rad) return std::nullopt;
  return Gap{(f + 0.5 * gap_rad * e).normalized(), e, line.range_m[i]};
}

std::vector<Gap> find_gaps(const std::vector<Vector3d>& points_lidar, double min_depth_ratio) {
  Line line;
  line.min_ratio = min_depth_ratio;
  for (const Vector3d& p_lidar : points_lidar) {
    line.range_m.push_back(p_lidar.norm());
    line.f_lidar.push_back(p_lidar / line.range_m.back());
  }
  line.step_rad = step_rad_of(line.f_lidar);
  std::vector<Gap> gaps;
  for (std::size_t i = 1; i + 2 < points_lidar.size(); ++i) {
    if (const auto gap = gap_at(line, i, 1)) gaps.push_back(*gap);
    if (const auto gap = gap_at(line, i + 1, -1)) gaps.push_back(*gap);
  }
  return gaps;
}

/// The straight piece through a gap and those of other lines around.
std::optional<LidarEdge> outline_through(const Gap& gap, const std::vector<Gap>& gaps) {
  const Vector3d up = gap.f_lidar.cross(gap.e_lidar);
  double xx = 0.0;
  double xy = 0.0;
  double yy = 0.0;
  int count = 0;
  for (const Gap& other : gaps) {
    const Vector3d d = other.f_lidar - gap.f_lidar;
    const double y = d.dot(up);
    if (std::abs(y) < kMinApart_rad || std::abs(y) > kMaxApart_rad) continue;
    const double x = d.dot(gap.e_lidar);
    if (std::abs(x) > kMaxSlope * std::abs(y) + kMaxBend_rad) continue;
    if (other.e_lidar.dot(gap.e_lidar) < 0.9) continue;
    if (std::abs(other.range_m - gap.range_m) > kSameRange * gap.range_m) continue;
    ++count;
    xx += x * x;
    xy += x * y;
    yy += y * y;
  }
  if (count < kMinPieces) return std::nullopt;
  const double slope = xy / yy;
  if (xx - slope * xy > kMaxBend_rad * kMaxBend_rad * count) return std::nullopt;
  LidarEdge edge;
  edge.p_lidar = gap.range_m * gap.f_lidar;
  edge.tangent_lidar = (up + slope * gap.e_lidar).normalized();
  edge.widening_lidar.col(0) = gap.range_m * gap.e_lidar;
  edge.strength = 1.0F;
  edge.kind = EdgeKind::kOutline;
  return edge;
}

}  // namespace

std::vector<LidarEdge> find_outlines(const std::vector<Vector3d>& points_lidar,
                                     double min_depth_ratio) {
  const std::vector<Gap> gaps = find_gaps(points_lidar, min_depth_ratio);
  std::vector<LidarEdge> edges;
  for (const Gap& gap : gaps) {
    if (const auto edge = outline_through(gap, gaps)) edges.push_back(*edge);
  }
  return edges;
}

}  // namespace camvox::calibration
