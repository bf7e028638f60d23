#include "evaluation.hpp"

#include <fmt/format.h>

#include <cmath>
#include <tuple>
#include <utility>

#include "camvox/trajectory/alignment.hpp"
#include "command.hpp"
#include "trajectory_source.hpp"

namespace camvox::command {
namespace {

using trajectory::Statistics;

constexpr double kDegrees = 180.0 / M_PI;

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

/// The two parts of relative errors, in m and degrees.
std::pair<Statistics, Statistics> parts(const std::vector<trajectory::RelativeError>& errors) {
  std::vector<double> translation_m;
  std::vector<double> rotation_deg;
  for (const auto& error : errors) {
    translation_m.push_back(error.translation_m);
    rotation_deg.push_back(kDegrees * error.rotation_rad);
  }
  return {trajectory::statistics(translation_m), trajectory::statistics(rotation_deg)};
}

void add_relative(const EvaluationOptions& options, Evaluation& result) {
  const auto errors = options.delta_unit == "m"
                          ? trajectory::relative_errors_by_path(result.aligned, options.delta)
                          : trajectory::relative_errors_by_frames(
                                result.aligned, static_cast<std::size_t>(options.delta));
  std::tie(result.rpe_m, result.rpe_deg) = parts(errors);
  std::tie(result.revisit_m, result.revisit_deg) =
      parts(trajectory::revisit_errors(result.aligned));
}

std::string row(const std::string& name, const Statistics& s) {
  return fmt::format(
      "| {:<18} | {:>9.4f} | {:>9.4f} | {:>9.4f} | {:>9.4f} | {:>9.4f} | {:>11.4f} | "
      "{:>9.4f} |\n",
      name,
      s.max,
      s.mean,
      s.median,
      s.min,
      s.rmse,
      s.sse,
      s.std);
}

std::string table_head() {
  constexpr auto kNames = "| {:<18} | {:>9} | {:>9} | {:>9} | {:>9} | {:>9} | {:>11} | {:>9} |\n";
  constexpr auto kRule =
      "| {:-<18} | {:->9} | {:->9} | {:->9} | {:->9} | {:->9} | {:->11} | {:->9} |\n";
  return fmt::format(kNames, "", "max", "mean", "median", "min", "rmse", "sse", "std") +
         fmt::format(kRule, "", "", "", "", "", "", "", "");
}

}  // namespace

Evaluation evaluate(const EvaluationOptions& options) {
  const auto reference = load_trajectory(options.reference, options.reference_topic);
  const auto estimate = load_trajectory(options.estimate, options.estimate_topic);
  Evaluation result;
  result.estimated = estimate.size();
  result.pairs =
      trajectory::associate(reference,
                            estimate,
                            static_cast<std::int64_t>(options.max_difference_s * 1e9),
                            static_cast<std::int64_t>(std::llround(options.offset_s * 1e9)));
  if (result.pairs.empty()) {
    throw CommandError(fmt::format(
        "no pose of {} ({} poses) is within {} s of one of {} ({} poses); see --offset and "
        "--max-difference",
        options.estimate,
        estimate.size(),
        options.max_difference_s,
        options.reference,
        reference.size()));
  }
  const auto alignment = *trajectory::parse_alignment(options.alignment);
  const auto similarity = trajectory::align(result.pairs, alignment);
  if (!similarity) {
    throw CommandError(fmt::format(
        "the {} pairs of poses do not determine an alignment: fewer than three, or on one line "
        "(--align origin takes the first pose)",
        result.pairs.size()));
  }
  result.on_a_line = similarity->on_a_line;
  result.aligned = trajectory::transformed(*similarity, result.pairs);
  trajectory::Trajectory driven;
  for (const auto& pair : result.pairs) driven.push_back(pair.reference);
  result.length_m = trajectory::path_length_m(driven);
  if (const auto sim3 = trajectory::align(result.pairs, trajectory::Alignment::kSim3)) {
    result.scale = sim3->scale;
  }
  result.ape_m = trajectory::statistics(trajectory::absolute_errors_m(result.aligned));
  result.ape_deg =
      trajectory::statistics(scaled(trajectory::absolute_errors_rad(result.aligned), kDegrees));
  add_relative(options, result);
  result.kitti = trajectory::kitti_errors(result.aligned);
  return result;
}

std::string to_markdown(const EvaluationOptions& options, const Evaluation& result) {
  std::string text = fmt::format(
      "{} of {} poses paired, path {:.2f} m, alignment {}{}\n\n",
      result.pairs.size(),
      result.estimated,
      result.length_m,
      options.alignment,
      result.scale ? fmt::format(", scale error {:+.3f} %", 100.0 * (1.0 / *result.scale - 1.0))
                   : "");
  if (result.on_a_line) {
    text += "the path is nearly a line: orientations tell how the estimate is rolled about it\n\n";
  }
  text += table_head();
  text += row("APE (m)", result.ape_m);
  text += row("APE rotation (deg)", result.ape_deg);
  const auto delta = fmt::format("{:g} {}", options.delta, options.delta_unit);
  if (result.rpe_m.count > 0) {
    text += row(fmt::format("RPE {} (m)", delta), result.rpe_m);
    text += row(fmt::format("RPE {} (deg)", delta), result.rpe_deg);
  } else {
    text += fmt::format("\nno RPE: the path is shorter than twice {}\n", delta);
  }
  if (result.kitti) {
    text += fmt::format(
        "\nKITTI: t_rel {:.3f} %, r_rel {:.4f} deg/100 m over {} stretches of 100 to 800 m\n",
        result.kitti->t_rel_percent,
        result.kitti->r_rel_deg_per_100m,
        result.kitti->stretches);
  }
  if (result.revisit_m.count > 0) {
    text += fmt::format(
        "\n{} poses are at places passed before in the same direction; between the two passes:\n\n",
        result.revisit_m.count);
    text += table_head();
    text += row("revisit (m)", result.revisit_m);
    text += row("revisit (deg)", result.revisit_deg);
  }
  return text;
}

}  // namespace camvox::command
