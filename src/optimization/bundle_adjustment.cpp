#include "camvox/optimization/bundle_adjustment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "bundle_solver.hpp"

namespace camvox::optimization {
namespace {

void check(const BundleProblem& problem) {
  for (const auto& observation : problem.observations) {
    if (observation.pose >= problem.poses.size() ||
        observation.point >= problem.points_world.size()) {
      throw std::logic_error("bundle adjustment: observation of a pose or point that is not there");
    }
  }
}

std::optional<PointResidual> residual_of(const BundleProblem& problem,
                                         const BundleObservation& observation) {
  return evaluate(problem.poses[observation.pose].T_world_camera,
                  problem.points_world[observation.point],
                  observation.observation,
                  problem.camera,
                  problem.depth_model);
}

/// Judges the observations listed in `judged` at the present poses and points.
void gate(BundleProblem& problem,
          const std::vector<std::uint32_t>& judged,
          const BundleAdjustmentConfig& config) {
  for (const auto i : judged) {
    auto& observation = problem.observations[i];
    const auto residual = residual_of(problem, observation);
    observation.outlier = !residual || !(residual->r.head<2>().squaredNorm() <= config.pixel_gate);
    observation.depth_outlier =
        !observation.outlier && !(residual->r[2] * residual->r[2] <= config.depth_gate);
  }
}

/// Takes out what is behind its camera, where the cost is not defined, or NaN.
void drop_unseen(BundleProblem& problem, const std::vector<std::uint32_t>& judged) {
  for (const auto i : judged) {
    auto& observation = problem.observations[i];
    const auto residual = residual_of(problem, observation);
    if (!residual || !residual->r.allFinite()) observation.outlier = true;
  }
}

std::vector<std::uint32_t> unflagged(const BundleProblem& problem) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < problem.observations.size(); ++i) {
    if (!problem.observations[i].outlier) list.push_back(i);
  }
  return list;
}

struct ObservationCost {
  double pixel = 0.0;
  double depth = 0.0;
};

/// Robust, of the listed observations, in their order.
std::vector<ObservationCost> costs_of(const BundleProblem& problem,
                                      const std::vector<std::uint32_t>& counted,
                                      const BundleAdjustmentConfig& config) {
  std::vector<ObservationCost> costs(counted.size());
  for (std::size_t k = 0; k < counted.size(); ++k) {
    const auto residual = residual_of(problem, problem.observations[counted[k]]);
    if (!residual) continue;  // moved behind the camera: an outlier, of no defined cost
    costs[k].pixel =
        0.5 * internal::huber(residual->r.head<2>().squaredNorm(), config.pixel_gate).value;
    costs[k].depth =
        0.5 * internal::huber(residual->r[2] * residual->r[2], config.depth_gate).value;
  }
  return costs;
}

/// Over what is no outlier now: a few gross ones would outweigh all that was adjusted.
double kept_cost(const BundleProblem& problem,
                 const std::vector<std::uint32_t>& counted,
                 const std::vector<ObservationCost>& costs) {
  double sum = 0.0;
  for (std::size_t k = 0; k < counted.size(); ++k) {
    const BundleObservation& observation = problem.observations[counted[k]];
    if (observation.outlier) continue;
    sum += costs[k].pixel;
    if (!observation.depth_outlier) sum += costs[k].depth;
  }
  return sum;
}

bool is_set(const std::atomic<bool>* stop) {
  return stop != nullptr && stop->load(std::memory_order_relaxed);
}

/// Returns how many iterations it took.
int run_round(BundleProblem& problem,
              const BundleAdjustmentConfig& config,
              int max_iterations,
              const std::atomic<bool>* stop) {
  if (max_iterations == 0 || is_set(stop)) return 0;
  return internal::BundleSolver(problem, config).run(max_iterations, stop);
}

void count(const BundleProblem& problem, BundleSummary& summary) {
  for (const auto& pose : problem.poses) ++(pose.fixed ? summary.fixed_poses : summary.free_poses);
  summary.points = problem.points_world.size();
  summary.observations = problem.observations.size();
}

}  // namespace

BundleSummary adjust(BundleProblem& problem,
                     const BundleAdjustmentConfig& config,
                     const std::atomic<bool>* stop) {
  check(problem);
  BundleSummary summary;
  count(problem, summary);
  drop_unseen(problem, unflagged(problem));
  const auto judged = unflagged(problem);
  if (summary.free_poses == 0 || judged.empty()) return summary;

  const auto costs_before = costs_of(problem, judged, config);
  summary.iterations = run_round(problem, config, config.first_iterations, stop);
  // Poses that have yet to settle are no judges.
  if (!is_set(stop)) {
    gate(problem, judged, config);
    summary.iterations += run_round(problem, config, config.second_iterations, stop);
    gate(problem, judged, config);
  }
  summary.cost_before = kept_cost(problem, judged, costs_before);
  summary.cost_after = kept_cost(problem, judged, costs_of(problem, judged, config));
  for (const auto& observation : problem.observations) {
    if (observation.outlier) ++summary.outliers;
    if (observation.depth_outlier) ++summary.depth_outliers;
  }
  summary.status =
      is_set(stop) ? BundleSummary::Status::kInterrupted : BundleSummary::Status::kConverged;
  return summary;
}

std::string BundleSummary::to_string(double time_s) const {
  constexpr std::array kNames = {"converged", "interrupted", "nothing to do"};
  std::array<char, 256> text{};
  std::snprintf(text.data(),
                text.size(),
                "bundle adjustment %s: cost %.6g -> %.6g in %d iterations and %.1f ms; %zu+%zu "
                "poses, %zu points, %zu observations, %zu outliers, %zu in depth",
                kNames.at(static_cast<std::size_t>(status)),
                cost_before,
                cost_after,
                iterations,
                1e3 * time_s,
                free_poses,
                fixed_poses,
                points,
                observations,
                outliers,
                depth_outliers);
  return text.data();
}

}  // namespace camvox::optimization
