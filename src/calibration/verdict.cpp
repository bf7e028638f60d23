#include "verdict.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace camvox::calibration {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kObservable_m = 0.02;  ///< A translation known this well is observed.
constexpr double kDepth_m = 10.0;       ///< A shared error turns, or moves what is so far away.

double angle_deg(const SE3& T_a, const SE3& T_b) {
  return (T_a.rotation().inverse() * T_b.rotation()).angle_rad() / kDegree;
}

/// How far the offsets that `linearise` finds follow a rotation: the mean of a window follows an
/// edge only in part. The derivative of its right side, by central differences, over H.
double following(const Alignment& alignment,
                 const Fit& fit,
                 const Stage& stage,
                 const Matrix8d& H) {
  const double step_rad = 0.2 * stage.reach_px / alignment.focal_px();
  Eigen::Matrix3d slope;
  for (int i = 0; i < 3; ++i) {
    const Vector6d step = step_rad * Vector6d::Unit(i);
    const auto b = [&](double side) {
      const SE3 T = geometry::retract(fit.T_camera_lidar, side * step);
      return alignment.linearise({T, fit.widening_rad}, stage).b;
    };
    slope.col(i) = (b(-1.0) - b(1.0)).head<3>() / (2.0 * step_rad);
  }
  const Eigen::Matrix3d full = H.topLeftCorner<3, 3>();
  return std::clamp(slope.cwiseProduct(full).sum() / full.squaredNorm(), 0.1, 1.0);
}

void add_precision(const Alignment& alignment,
                   const Contest& contest,
                   const Vector6d& between_halves,
                   CalibrationResult& result) {
  const Fit fit{result.T_camera_lidar, result.widening_rad};
  const NormalEquations equations = alignment.linearise(fit, contest.stage);
  result.inlier_share = equations.weight > 0.0 ? equations.inlier_weight / equations.weight : 0.0;
  if (!(equations.inlier_weight > 0.0)) return;
  const Matrix6d covariance = covariance_of(alignment, fit, contest.stage, contest.prior);
  // Each half has twice the variance, their difference four times.
  const double surprise =
      between_halves.head<3>().squaredNorm() / (4.0 * covariance.topLeftCorner<3, 3>().trace());
  result.covariance_lidar = covariance * std::max(1.0, surprise);
  using Solver = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>;
  const Solver rotation(result.covariance_lidar.topLeftCorner<3, 3>());
  const Solver translation(result.covariance_lidar.bottomRightCorner<3, 3>());
  result.sigma_rotation_deg = std::sqrt(rotation.eigenvalues().maxCoeff()) / kDegree;
  result.sigma_translation_m = std::sqrt(translation.eigenvalues().maxCoeff());
  for (int i = 0; i < 3; ++i) {
    if (std::sqrt(translation.eigenvalues()[i]) < kObservable_m) ++result.observable_translations;
  }
}

std::string number(const char* format, double a, double b) {
  char text[160];
  std::snprintf(text, sizeof(text), format, a, b);
  return text;
}

}  // namespace

Matrix6d covariance_of(const Alignment& alignment,
                       const Fit& fit,
                       const Stage& stage,
                       const Prior& prior) {
  const NormalEquations equations = alignment.linearise(fit, stage);
  const Matrix8d prior_share = prior_information(prior);
  const double scale =
      kIndependentShare / std::pow(stage.reach_px, 2);  // as solve_step weighs the data
  Matrix8d spread = Matrix8d::Zero();
  double tiles = 0.0;
  for (const Vector8d& gradient : alignment.tile_gradients(fit, stage)) {
    spread += gradient * gradient.transpose();
    tiles += gradient.isZero(0.0) ? 0.0 : 1.0;
  }
  // As many tiles are used up as there are unknowns.
  spread *= scale * scale * tiles / std::max(1.0, tiles - 6.0);
  const double share = following(alignment, fit, stage, equations.H);
  const Matrix8d slope = scale * share * equations.H + prior_share;
  const Matrix8d inverse = slope.ldlt().solve(Matrix8d::Identity());
  Matrix6d covariance =
      (inverse * (spread + prior_share) * inverse.transpose()).topLeftCorner<6, 6>();
  const double shared_rad = stage.shared_error * alignment.scenes().front().lidar.sigma_rad;
  covariance.diagonal().head<3>().array() += std::pow(shared_rad, 2);
  covariance.diagonal().tail<3>().array() += std::pow(shared_rad * kDepth_m, 2);
  return covariance;
}

void examine(const Alignment& alignment, const Contest& contest, CalibrationResult& result) {
  const std::size_t level = alignment.levels() - 1;
  const SE3& T = result.T_camera_lidar;
  const auto fit = [&](Part part) {
    const Fit start{alignment.climb(T, level, contest.prior, part), result.widening_rad};
    return alignment.refine(start, contest.stage, contest.prior, part).T_camera_lidar;
  };
  const auto stopped = [&] { return contest.stop.stop_requested(); };
  const SE3 even = fit(Part::kEven);
  if (stopped()) return;
  const SE3 odd = fit(Part::kOdd);
  if (stopped()) return;
  result.disagreement_deg = std::max(angle_deg(even, T), angle_deg(odd, T));
  const SE3& guess = contest.guess;
  result.held_back_before = 0.5 * (alignment.score(guess, level, Part::kOdd) +
                                   alignment.score(guess, level, Part::kEven));
  const Gain gain_odd = alignment.gain(even, guess, level, Part::kOdd);
  const Gain gain_even = alignment.gain(odd, guess, level, Part::kEven);
  result.held_back_after = result.held_back_before + 0.5 * (gain_odd.mean + gain_even.mean);
  result.held_back_error = 0.5 * std::hypot(gain_odd.standard_error, gain_even.standard_error);
  result.score_before = alignment.score(guess, level);
  result.score_after = alignment.score(T, level);
  if (stopped()) return;
  const Gain fit_gain = alignment.gain_over_nothing(T, level);
  const double best = std::max(1e-3, alignment.best_gain(level));
  result.fit = fit_gain.mean / best;
  result.fit_error = fit_gain.standard_error / best;
  if (contest.rival) {
    result.rival_fit = alignment.gain_over_nothing(*contest.rival, level).mean / best;
    const Gain lead = alignment.gain(T, *contest.rival, level);
    result.lead = lead.mean / std::max(1e-9, lead.standard_error);
  }
  if (stopped()) return;
  result.resolution_deg = alignment.scenes().front().lidar.sigma_rad / kDegree;
  add_precision(alignment, contest, geometry::local(even, odd), result);
}

std::string objection(const CalibrationResult& r, const GateConfig& gate) {
  const double min_fit = std::max(gate.min_fit, gate.min_significance * r.fit_error);
  if (r.fit < min_fit) {
    return number("the edges hardly fit: %.2f of a perfect fit, not %.2f", r.fit, min_fit);
  }
  if (r.rival_fit > gate.max_rival * r.fit && r.lead < gate.min_lead) {
    return number("another place fits nearly as well: %.2f of this one, only %.1f sigma behind",
                  r.rival_fit / r.fit,
                  r.lead);
  }
  const double limit_deg = std::max(gate.max_sigma_deg, gate.max_sigma * r.resolution_deg);
  if (r.sigma_rotation_deg > limit_deg) {
    return number("rotation known to %.3f deg only, not %.3f", r.sigma_rotation_deg, limit_deg);
  }
  if (r.disagreement_deg > 2.0 * limit_deg) {
    return number("halves of the data disagree by %.3f deg, more than %.3f",
                  r.disagreement_deg,
                  2.0 * limit_deg);
  }
  if (r.held_back_after - r.held_back_before < gate.min_gain * r.held_back_error) {
    return number("not better than before on held-back data: by %.3f, with an error of %.3f",
                  r.held_back_after - r.held_back_before,
                  r.held_back_error);
  }
  return {};
}

}  // namespace camvox::calibration
