#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "camvox/trajectory/metrics.hpp"
#include "camvox/trajectory/trajectory.hpp"

namespace camvox::command {

/// What to compare, and how.
struct EvaluationOptions {
  std::string reference;  ///< TUM or KITTI file, or a bag.
  std::string estimate;   ///< The same.
  std::string reference_topic;
  std::string estimate_topic;
  std::string alignment = "se3";
  double max_difference_s = 0.01;  ///< Between paired poses.
  double offset_s = 0.0;           ///< Added to the estimate's stamps.
  double delta = 10.0;             ///< Stretches of the RPE.
  std::string delta_unit = "m";    ///< Or "f": frames.
};

/// How far an estimate is from its reference.
struct Evaluation {
  std::size_t estimated = 0;
  std::vector<trajectory::PosePair> pairs;    ///< As read.
  std::vector<trajectory::PosePair> aligned;  ///< Estimates laid over the references.
  double length_m = 0.0;
  bool on_a_line = false;       ///< See trajectory::Similarity.
  std::optional<double> scale;  ///< Of the reference over the estimate.
  trajectory::Statistics ape_m;
  trajectory::Statistics ape_deg;
  trajectory::Statistics rpe_m;
  trajectory::Statistics rpe_deg;
  trajectory::Statistics revisit_m;  ///< Of trajectory::revisit_errors.
  trajectory::Statistics revisit_deg;
  std::optional<trajectory::KittiErrors> kitti;
};

/// Throws CommandError when the two cannot be compared.
[[nodiscard]] Evaluation evaluate(const EvaluationOptions& options);

/// The figures as a table in Markdown, with a line above that says what was compared.
[[nodiscard]] std::string to_markdown(const EvaluationOptions& options, const Evaluation& result);

}  // namespace camvox::command
