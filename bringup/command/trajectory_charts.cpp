#include "trajectory_charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "camvox/trajectory/metrics.hpp"

namespace camvox::command {
namespace {

constexpr auto kReferenceColor = "#888888";
constexpr auto kEstimateColor = "#d62728";
constexpr int kWidth_px = 760;
constexpr int kHeight_px = 420;

/// How a robot may climb: a path that spreads more in z, over its spread in x and y, is one of a
/// camera's axes, or somebody waves the sensor about.
constexpr double kSteepest = 0.5;

/// The axis to look along: z, which is up, unless the path says that it is not. Then the one in
/// which the positions spread least.
int viewing_axis(const std::vector<trajectory::PosePair>& pairs) {
  Eigen::Vector3d low = pairs.front().reference.T_world_body.translation();
  Eigen::Vector3d high = low;
  for (const auto& pair : pairs) {
    low = low.cwiseMin(pair.reference.T_world_body.translation());
    high = high.cwiseMax(pair.reference.T_world_body.translation());
  }
  const Eigen::Vector3d spread = high - low;
  if (spread.z() <= kSteepest * std::max(spread.x(), spread.y())) return 2;
  int axis = 0;
  spread.minCoeff(&axis);
  return axis;
}

}  // namespace

trajectory::Chart plan_chart(const std::vector<trajectory::PosePair>& aligned) {
  trajectory::Chart chart;
  chart.title = "Trajectory";
  chart.equal_scales = true;
  if (aligned.empty()) return chart;
  constexpr std::array<std::array<int, 2>, 3> kOthers = {{{1, 2}, {0, 2}, {0, 1}}};
  const int along = viewing_axis(aligned);
  chart.title += along == 2 ? " from above" : fmt::format(" seen along {}", "xyz"[along]);
  const auto [x, y] = kOthers[static_cast<std::size_t>(along)];
  chart.x_label = fmt::format("{} (m)", "xyz"[x]);
  chart.y_label = fmt::format("{} (m)", "xyz"[y]);
  trajectory::Series reference{"reference", kReferenceColor, {}};
  trajectory::Series estimate{"estimate", kEstimateColor, {}};
  for (const auto& pair : aligned) {
    const auto& p_reference = pair.reference.T_world_body.translation();
    const auto& p_estimate = pair.estimate.T_world_body.translation();
    reference.points.push_back({p_reference[x], p_reference[y]});
    estimate.points.push_back({p_estimate[x], p_estimate[y]});
  }
  chart.series = {std::move(reference), std::move(estimate)};
  return chart;
}

trajectory::Chart error_chart(const std::vector<trajectory::PosePair>& aligned) {
  trajectory::Chart chart;
  chart.title = "Absolute position error";
  chart.x_label = "time (s)";
  chart.y_label = "error (m)";
  trajectory::Series series{"", kEstimateColor, {}};
  const auto errors_m = trajectory::absolute_errors_m(aligned);
  for (std::size_t i = 0; i < aligned.size(); ++i) {
    const auto since_start_ns = aligned[i].reference.stamp_ns - aligned[0].reference.stamp_ns;
    series.points.push_back({1e-9 * static_cast<double>(since_start_ns), errors_m[i]});
  }
  chart.series = {std::move(series)};
  return chart;
}

std::string stack_svgs(const std::vector<std::string>& svgs) {
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
      "height=\"{1}\">\n",
      kWidth_px,
      kHeight_px * svgs.size());
  for (std::size_t i = 0; i < svgs.size(); ++i) {
    text += fmt::format("<g transform=\"translate(0 {})\">\n{}</g>\n", kHeight_px * i, svgs[i]);
  }
  return text + "</svg>\n";
}

}  // namespace camvox::command
