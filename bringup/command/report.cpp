#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>

#include "command.hpp"
#include "evaluation.hpp"
#include "report_page.hpp"
#include "run_results.hpp"
#include "trajectory_charts.hpp"
#include "trajectory_source.hpp"

namespace camvox::command {
namespace {

namespace fs = std::filesystem;

struct ReportOptions {
  std::string folder;
  std::string reference;
  std::string reference_topic;
  std::string alignment = "se3";
  std::string title;
};

/// Table II of the CamVox paper (Zhu et al., ICRA 2021): ms a frame on an i7-8550U.
const std::map<std::string, std::string> kPaperTimes_ms = {{"deskew", "0.89"},
                                                           {"depth", "16.35"},
                                                           {"tracking", "42.27"},
                                                           {"mapping", "252.41 a keyframe"}};

struct Report {
  fs::path folder;
  std::vector<FrameRow> frames;
  std::vector<TimingRow> timing;
  trajectory::Trajectory estimate;
  std::optional<Evaluation> evaluation;
};

std::size_t tracked(const Report& report) {
  return static_cast<std::size_t>(
      std::count_if(report.frames.begin(), report.frames.end(), [](const FrameRow& frame) {
        return frame.state == "ok" || frame.state == "localisation_only";
      }));
}

Report collect(const ReportOptions& options) {
  Report report;
  report.folder = options.folder;
  report.frames = read_frames(report.folder);
  report.timing = read_timing(report.folder);
  report.estimate = load_trajectory(report.folder / "trajectory.tum");
  if (!options.reference.empty()) {
    EvaluationOptions evaluation;
    evaluation.reference = options.reference;
    evaluation.reference_topic = options.reference_topic;
    evaluation.estimate = report.folder / "trajectory.tum";
    evaluation.alignment = options.alignment;
    report.evaluation = evaluate(evaluation);
  }
  return report;
}

double seconds_since_start(const Report& report, const FrameRow& frame) {
  return 1e-9 * static_cast<double>(frame.stamp_ns - report.frames.front().stamp_ns);
}

trajectory::Chart matches_chart(const Report& report) {
  trajectory::Chart chart;
  chart.title = "Features and matches";
  chart.x_label = "time (s)";
  chart.y_label = "count a frame";
  chart.series = {
      {"features", "#bbbbbb", {}}, {"with depth", "#1f77b4", {}}, {"inliers", "#2ca02c", {}}};
  for (const auto& frame : report.frames) {
    const double t_s = seconds_since_start(report, frame);
    chart.series[0].points.push_back({t_s, frame.features});
    chart.series[1].points.push_back({t_s, frame.with_depth});
    chart.series[2].points.push_back({t_s, frame.inliers});
  }
  return chart;
}

/// Without a reference there is only the estimate to draw.
std::vector<trajectory::PosePair> drawn_pairs(const Report& report) {
  if (report.evaluation) return report.evaluation->aligned;
  std::vector<trajectory::PosePair> pairs;
  for (const auto& pose : report.estimate) pairs.push_back({pose, pose});
  return pairs;
}

std::string fixed(double value, int digits) { return fmt::format("{:.{}f}", value, digits); }

void add_verdict(const Report& report, ReportPage& page) {
  std::vector<std::pair<std::string, std::string>> facts = {
      {"frames tracked", fmt::format("{} of {}", tracked(report), report.frames.size())},
      {"path", fixed(trajectory::path_length_m(report.estimate), 1) + " m"}};
  if (report.evaluation) {
    const auto& ape = report.evaluation->ape_m;
    facts.emplace_back("APE rmse", fixed(ape.rmse, 3) + " m");
    facts.emplace_back("APE max", fixed(ape.max, 3) + " m");
    if (report.evaluation->scale) {
      facts.emplace_back("scale error",
                         fmt::format("{:+.2f} %", 100.0 * (1.0 / *report.evaluation->scale - 1.0)));
    }
  }
  page.facts(facts);
}

std::vector<std::string> row_of(const std::string& name, const trajectory::Statistics& s) {
  std::vector<std::string> row = {name};
  for (const double value : {s.max, s.mean, s.median, s.min, s.rmse, s.sse, s.std}) {
    row.push_back(fixed(value, 4));
  }
  return row;
}

void add_errors(const Report& report, ReportPage& page) {
  if (!report.evaluation) {
    page.paragraph("No reference was given, so there are no errors to show (--reference).");
    return;
  }
  const auto& result = *report.evaluation;
  page.heading("Errors against the reference");
  page.paragraph(fmt::format(
      "{} of {} poses paired; rigid alignment by Umeyama.", result.pairs.size(), result.estimated));
  page.table({{"", "max", "mean", "median", "min", "rmse", "sse", "std"},
              row_of("APE (m)", result.ape_m),
              row_of("APE rotation (deg)", result.ape_deg),
              row_of("RPE over 10 m (m)", result.rpe_m),
              row_of("RPE over 10 m (deg)", result.rpe_deg)});
  page.chart(error_chart(result.aligned));
}

void add_timing(const Report& report, ReportPage& page) {
  page.heading("Processor time a frame (ms)");
  std::vector<std::vector<std::string>> rows = {
      {"component", "frames", "median", "mean", "p95", "p99", "max", "paper"}};
  for (const auto& timing : report.timing) {
    std::vector<std::string> row = {timing.component};
    row.insert(row.end(), timing.figures.begin(), timing.figures.end());
    const auto paper = kPaperTimes_ms.find(timing.component);
    row.push_back(paper == kPaperTimes_ms.end() ? "" : paper->second);
    rows.push_back(std::move(row));
  }
  page.table(rows);
  page.paragraph("Paper: CamVox's own figures on an i7-8550U; other machine, other data.");
}

/// Pictures go by name, but what came after goes right behind what was before.
std::pair<std::string, bool> place_of(const fs::path& picture) {
  constexpr std::string_view kAfter = "after";
  auto name = picture.stem().string();
  const bool after = name.ends_with(kAfter);
  if (after) name.replace(name.size() - kAfter.size(), kAfter.size(), "before");
  return {name, after};
}

void add_pictures(const Report& report, ReportPage& page) {
  std::vector<fs::path> pictures;
  for (const auto& entry : fs::directory_iterator(report.folder)) {
    if (entry.path().extension() == ".png") pictures.push_back(entry.path());
  }
  std::sort(pictures.begin(), pictures.end(), [](const auto& a, const auto& b) {
    return place_of(a) < place_of(b);
  });
  if (!pictures.empty()) page.heading("Pictures");
  for (const auto& picture : pictures) {
    std::string caption = picture.stem();
    std::replace(caption.begin(), caption.end(), '_', ' ');
    page.picture(read_file(picture), caption);
  }
}

int run(const ReportOptions& options) {
  const auto report = collect(options);
  if (report.frames.empty()) throw CommandError(options.folder + ": the run saw no frame");
  ReportPage page(options.title.empty() ? "camvox: " + report.folder.lexically_normal().string()
                                        : options.title);
  add_verdict(report, page);
  page.chart(plan_chart(drawn_pairs(report)));
  add_errors(report, page);
  page.heading("Matches");
  page.chart(matches_chart(report));
  add_timing(report, page);
  add_pictures(report, page);
  if (const auto config = report.folder / "config.yaml"; fs::exists(config)) {
    page.details("Configuration of the run", read_file(config));
  }
  const auto file = report.folder / "report.html";
  std::ofstream stream(file, std::ios::trunc);
  if (!(stream << page.html() << std::flush))
    throw CommandError(file.string() + ": cannot be written");
  fmt::print("{}\n", file.string());
  return Exit::kDone;
}

}  // namespace

void add_report(CLI::App& app, Action& action) {
  auto options = std::make_shared<ReportOptions>();
  auto* command = app.add_subcommand("report", "Make a page of the results of a run");
  command->add_option("folder", options->folder, "What `camvox run --out` wrote")->required();
  command->add_option("--reference", options->reference, "True trajectory: TUM or KITTI file, bag");
  command->add_option("--reference-topic", options->reference_topic, "Topic of a reference bag");
  command->add_option("--align", options->alignment, "none, origin, se3 (default) or sim3")
      ->check(CLI::IsMember({"none", "origin", "se3", "sim3"}));
  command->add_option("--title", options->title, "Of the page");
  command->callback([options, &action] { action = [options] { return run(*options); }; });
}

}  // namespace camvox::command
