#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>

#include "camvox/trajectory/alignment.hpp"
#include "camvox/trajectory/chart.hpp"
#include "camvox/trajectory/metrics.hpp"
#include "command.hpp"
#include "trajectory_charts.hpp"
#include "trajectory_source.hpp"

namespace camvox::command {
namespace {

using trajectory::PosePair;
using trajectory::Statistics;

constexpr double kDegrees = 180.0 / M_PI;

struct EvaluateOptions {
  std::string reference;
  std::string estimate;
  std::string reference_topic;
  std::string estimate_topic;
  std::string alignment = "se3";
  double max_difference_s = 0.01;
  double offset_s = 0.0;
  double delta = 10.0;
  std::string delta_unit = "m";
  std::string plot;
  std::string json;
};

struct Evaluation {
  std::size_t estimated = 0;
  std::vector<PosePair> pairs;    ///< As read.
  std::vector<PosePair> aligned;  ///< Estimates laid over the references.
  double length_m = 0.0;
  std::optional<double> scale;  ///< Of the reference over the estimate.
  Statistics ape_m;
  Statistics ape_deg;
  Statistics rpe_m;
  Statistics rpe_deg;
  std::optional<trajectory::KittiErrors> kitti;
};

std::vector<double> scaled(std::vector<double> values, double factor) {
  for (double& value : values) value *= factor;
  return values;
}

void add_relative(const EvaluateOptions& options, Evaluation& result) {
  const auto errors = options.delta_unit == "m"
                          ? trajectory::relative_errors_by_path(result.aligned, options.delta)
                          : trajectory::relative_errors_by_frames(
                                result.aligned, static_cast<std::size_t>(options.delta));
  std::vector<double> translation_m;
  std::vector<double> rotation_deg;
  for (const auto& error : errors) {
    translation_m.push_back(error.translation_m);
    rotation_deg.push_back(kDegrees * error.rotation_rad);
  }
  result.rpe_m = trajectory::statistics(translation_m);
  result.rpe_deg = trajectory::statistics(rotation_deg);
}

Evaluation evaluate(const EvaluateOptions& options) {
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

void print_row(const std::string& name, const Statistics& s) {
  fmt::print(
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

void print(const EvaluateOptions& options, const Evaluation& result) {
  fmt::print("{} of {} poses paired, path {:.2f} m, alignment {}{}\n\n",
             result.pairs.size(),
             result.estimated,
             result.length_m,
             options.alignment,
             result.scale
                 ? fmt::format(", scale error {:+.3f} %", 100.0 * (1.0 / *result.scale - 1.0))
                 : "");
  fmt::print("| {:<18} | {:>9} | {:>9} | {:>9} | {:>9} | {:>9} | {:>11} | {:>9} |\n",
             "",
             "max",
             "mean",
             "median",
             "min",
             "rmse",
             "sse",
             "std");
  fmt::print("| {:-<18} | {:->9} | {:->9} | {:->9} | {:->9} | {:->9} | {:->11} | {:->9} |\n",
             "",
             "",
             "",
             "",
             "",
             "",
             "",
             "");
  print_row("APE (m)", result.ape_m);
  print_row("APE rotation (deg)", result.ape_deg);
  const auto delta = fmt::format("{:g} {}", options.delta, options.delta_unit);
  if (result.rpe_m.count > 0) {
    print_row(fmt::format("RPE {} (m)", delta), result.rpe_m);
    print_row(fmt::format("RPE {} (deg)", delta), result.rpe_deg);
  } else {
    fmt::print("\nno RPE: the path is shorter than twice {}\n", delta);
  }
  if (result.kitti) {
    fmt::print(
        "\nKITTI: t_rel {:.3f} %, r_rel {:.4f} deg/100 m over {} stretches of 100 to 800 m\n",
        result.kitti->t_rel_percent,
        result.kitti->r_rel_deg_per_100m,
        result.kitti->stretches);
  }
}

std::string json_of(const Statistics& s) {
  return fmt::format(
      "{{\"max\": {}, \"mean\": {}, \"median\": {}, \"min\": {}, \"rmse\": {}, \"sse\": {}, "
      "\"std\": {}, \"count\": {}}}",
      s.max,
      s.mean,
      s.median,
      s.min,
      s.rmse,
      s.sse,
      s.std,
      s.count);
}

std::string to_json(const EvaluateOptions& options, const Evaluation& result) {
  std::string text = fmt::format(
      "{{\n  \"pairs\": {},\n  \"poses\": {},\n  \"length_m\": {},\n  \"alignment\": \"{}\",\n",
      result.pairs.size(),
      result.estimated,
      result.length_m,
      options.alignment);
  if (result.scale) {
    text += fmt::format("  \"scale_error_percent\": {},\n", 100.0 * (1.0 / *result.scale - 1.0));
  }
  if (result.kitti) {
    text += fmt::format("  \"t_rel_percent\": {},\n  \"r_rel_deg_per_100m\": {},\n",
                        result.kitti->t_rel_percent,
                        result.kitti->r_rel_deg_per_100m);
  }
  return text +
         fmt::format(
             "  \"ape_m\": {},\n  \"ape_deg\": {},\n  \"rpe_m\": {},\n  \"rpe_deg\": {}\n}}\n",
             json_of(result.ape_m),
             json_of(result.ape_deg),
             json_of(result.rpe_m),
             json_of(result.rpe_deg));
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::trunc);
  if (!(file << text << std::flush)) throw CommandError(path + ": cannot be written");
}

int run(const EvaluateOptions& options) {
  const auto result = evaluate(options);
  print(options, result);
  if (!options.plot.empty()) {
    write_file(options.plot,
               stack_svgs({trajectory::to_svg(plan_chart(result.aligned)),
                           trajectory::to_svg(error_chart(result.aligned))}));
    fmt::print("\nplot: {}\n", options.plot);
  }
  if (!options.json.empty()) write_file(options.json, to_json(options, result));
  return Exit::kDone;
}

}  // namespace

void add_evaluate(CLI::App& app, Action& action) {
  auto options = std::make_shared<EvaluateOptions>();
  auto* command =
      app.add_subcommand("evaluate", "Compare a trajectory with a reference (APE, RPE)");
  command->add_option("reference", options->reference, "TUM or KITTI file, or a bag with poses")
      ->required();
  command->add_option("estimate", options->estimate, "The same")->required();
  command->add_option("--reference-topic", options->reference_topic, "Topic of a reference bag");
  command->add_option("--estimate-topic", options->estimate_topic, "Topic of an estimate bag");
  command->add_option("--align", options->alignment, "none, origin, se3 (default) or sim3")
      ->check(CLI::IsMember({"none", "origin", "se3", "sim3"}));
  command
      ->add_option("--max-difference",
                   options->max_difference_s,
                   "Largest time between paired poses, in s (default: 0.01)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--offset", options->offset_s, "Added to the estimate's stamps, in s");
  command->add_option("--delta", options->delta, "Length of the stretches of the RPE (default: 10)")
      ->check(CLI::PositiveNumber);
  command->add_option("--delta-unit", options->delta_unit, "m (default) or f, frames")
      ->check(CLI::IsMember({"m", "f"}));
  command->add_option("--plot", options->plot, "Writes trajectories and errors as an SVG");
  command->add_option("--json", options->json, "Writes all figures as JSON");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
