#include "tally.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace camvox::bench {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kObserved_m = 0.02;

long within(const std::vector<double>& values, double limit) {
  return std::count_if(values.begin(), values.end(), [&](double v) { return v <= limit; });
}

double mean(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(
      std::lround(share * static_cast<double>(values.size() - 1)))];
}

void Tally::add(const BenchCase& bench_case,
                const calibration::CalibrationResult& result,
                double seconds) {
  const auto error = geometry::local(bench_case.T_camera_lidar, result.T_camera_lidar);
  const double error_deg = error.head<3>().norm() / kDegree;
  rotation_deg_.push_back(error_deg);
  seconds_.push_back(seconds);
  cost_before_.push_back(result.camvox_cost_before);
  cost_after_.push_back(result.camvox_cost_after);
  if (result.accepted && error_deg > limits_.bad_deg) ++bad_applied_;
  if (!result.accepted && error_deg <= limits_.good_deg) ++good_refused_;
  std::fprintf(
      stderr,
      "%s: %.3f deg (%+.3f %+.3f %+.3f), %.3f m, sigma %.3f deg, score %.2f/%.2f, held back "
      "%.2f/%.2f +- "
      "%.2f, fit %.2f +- %.2f, rival %.2f by %.1f sigma, inlier %.2f, halves %.3f deg: %s\n",
      bench_case.name.c_str(),
      error_deg,
      error[0] / kDegree,
      error[1] / kDegree,
      error[2] / kDegree,
      error.tail<3>().norm(),
      result.sigma_rotation_deg,
      result.score_before,
      result.score_after,
      result.held_back_before,
      result.held_back_after,
      result.held_back_error,
      result.fit,
      result.fit_error,
      result.rival_fit,
      result.lead,
      result.inlier_share,
      result.disagreement_deg,
      result.accepted ? "accepted" : result.reason.c_str());
  if (error_deg > limits_.bad_deg || !(result.sigma_rotation_deg > 0.0)) return;
  sigma_deg_.push_back(result.sigma_rotation_deg);
  normalised_.push_back(error.dot(result.covariance_lidar.ldlt().solve(error)) / 6.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> translation(
      result.covariance_lidar.bottomRightCorner<3, 3>());
  for (int i = 0; i < 3; ++i) {
    if (std::sqrt(translation.eigenvalues()[i]) > kObserved_m) continue;
    observed_m_.push_back(std::abs(translation.eigenvectors().col(i).dot(error.tail<3>())));
  }
}

void Tally::add(const Tally& other) {
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(rotation_deg_, other.rotation_deg_);
  append(observed_m_, other.observed_m_);
  append(normalised_, other.normalised_);
  append(seconds_, other.seconds_);
  append(sigma_deg_, other.sigma_deg_);
  append(cost_before_, other.cost_before_);
  append(cost_after_, other.cost_after_);
  bad_applied_ += other.bad_applied_;
  good_refused_ += other.good_refused_;
}

void Tally::print_head(Limits limits) {
  std::printf(
      "| scene | within %.1f deg | median deg | p95 deg | max deg | observed axes within 2 cm | "
      "median cm | p95 cm | sigma deg | normalised error | worse than %.1f deg applied | good "
      "refused | CPU s median | max |\n",
      limits.good_deg,
      limits.bad_deg);
  std::puts(
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
}

void Tally::print(const std::string& name) const {
  std::printf(
      "| %s | %ld/%zu | %.3f | %.3f | %.3f | %ld/%zu | %.1f | %.1f | %.3f | %.2f | %d | %d/%ld | "
      "%.2f | %.2f |\n",
      name.c_str(),
      within(rotation_deg_, limits_.good_deg),
      rotation_deg_.size(),
      quantile(rotation_deg_, 0.5),
      quantile(rotation_deg_, 0.95),
      quantile(rotation_deg_, 1.0),
      within(observed_m_, kObserved_m),
      observed_m_.size(),
      100.0 * quantile(observed_m_, 0.5),
      100.0 * quantile(observed_m_, 0.95),
      quantile(sigma_deg_, 0.5),
      std::sqrt(mean(normalised_)),
      bad_applied_,
      good_refused_,
      within(rotation_deg_, limits_.good_deg),
      quantile(seconds_, 0.5),
      quantile(seconds_, 1.0));
  std::fflush(stdout);
}

void Tally::print_costs(const std::string& name, double cost_truth) const {
  std::printf("| %s | %.2f | %.2f | %.2f | %.3f | %.3f | %.1f |\n",
              name.c_str(),
              quantile(cost_before_, 0.5),
              quantile(cost_after_, 0.5),
              cost_truth,
              quantile(rotation_deg_, 0.5),
              quantile(rotation_deg_, 1.0),
              quantile(seconds_, 0.5));
  std::fflush(stdout);
}

}  // namespace camvox::bench
