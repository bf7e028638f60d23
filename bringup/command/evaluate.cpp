#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>

#include "camvox/trajectory/chart.hpp"
#include "command.hpp"
#include "evaluation.hpp"
#include "trajectory_charts.hpp"
#include "validators.hpp"

namespace camvox::command {
namespace {

using trajectory::Statistics;

struct EvaluateOptions : EvaluationOptions {
  std::string plot;
  std::string json;
};

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
  if (result.revisit_m.count > 0) {
    text += fmt::format("  \"revisit_m\": {},\n  \"revisit_deg\": {},\n",
                        json_of(result.revisit_m),
                        json_of(result.revisit_deg));
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
  if (!options.plot.empty() && std::filesystem::path(options.plot).extension() != ".svg")
    throw CommandError("--plot " + options.plot + ": must end in .svg");
  const auto result = evaluate(options);
  fmt::print("{}", to_markdown(options, result));
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
      app.add_subcommand("evaluate", "Compare a trajectory with a reference (APE, RPE, revisits)");
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
      ->check(above_zero());
  command->add_option("--delta-unit", options->delta_unit, "m (default) or f, frames")
      ->check(CLI::IsMember({"m", "f"}));
  command->add_option("--plot", options->plot, "Writes trajectories and errors as an SVG");
  command->add_option("--json", options->json, "Writes all figures as JSON");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
