#include "bundle_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/CholmodSupport>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace camvox::optimization::internal {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr double kFirstLambda = 1e-4;
constexpr double kMaxLambda = 1e8;

bool in_use(const BundleObservation& observation) { return !observation.outlier; }

/// The observation as it counts: without a depth that is flagged.
PointObservation effective(const BundleObservation& observation) {
  PointObservation result = observation.observation;
  if (observation.depth_outlier) result.depth_m = 0.0;
  return result;
}

}  // namespace

Huber huber(double squared_error, double squared_threshold) {
  if (squared_error <= squared_threshold) return {1.0, squared_error};
  const double ratio = std::sqrt(squared_threshold / squared_error);
  return {ratio, squared_threshold * (2.0 / ratio - 1.0)};
}

BundleSolver::BundleSolver(BundleProblem& problem, const BundleAdjustmentConfig& config)
    : problem_(problem), config_(config) {
  number_free_poses();
  group_by_point();
  group_by_pose();
  find_blocks();
}

void BundleSolver::number_free_poses() {
  std::vector<bool> seen(problem_.poses.size(), false);
  for (const auto& observation : problem_.observations) {
    if (in_use(observation)) seen[observation.pose] = true;
  }
  free_index_.assign(problem_.poses.size(), -1);
  for (std::uint32_t i = 0; i < problem_.poses.size(); ++i) {
    if (problem_.poses[i].fixed || !seen[i]) continue;
    free_index_[i] = static_cast<std::int32_t>(free_poses_.size());
    free_poses_.push_back(i);
  }
  H_poses_.resize(free_poses_.size());
  g_poses_.resize(free_poses_.size());
}

void BundleSolver::group_by_point() {
  std::vector<std::uint32_t> count(problem_.points_world.size() + 1, 0);
  for (const auto& observation : problem_.observations) {
    if (in_use(observation)) ++count[observation.point + 1];
  }
  for (std::size_t i = 1; i < count.size(); ++i) count[i] += count[i - 1];
  for (std::uint32_t i = 0; i < problem_.points_world.size(); ++i) {
    if (count[i] < count[i + 1])
      points_.push_back({.index = i, .begin = count[i], .end = count[i + 1]});
  }
  links_.resize(count.back());
  for (std::uint32_t i = 0; i < problem_.observations.size(); ++i) {
    const auto& observation = problem_.observations[i];
    if (!in_use(observation)) continue;
    auto& link = links_[count[observation.point]++];
    link.observation = i;
    link.free_pose = free_index_[observation.pose];
  }
  for (std::uint32_t i = 0; i < points_.size(); ++i) {
    for (std::uint32_t k = points_[i].begin; k < points_[i].end; ++k) links_[k].point = i;
  }
  step_points_.resize(points_.size());
}

void BundleSolver::group_by_pose() {
  pose_begin_.assign(free_poses_.size() + 1, 0);
  for (const auto& link : links_) {
    if (link.free_pose >= 0) ++pose_begin_[static_cast<std::size_t>(link.free_pose) + 1];
  }
  for (std::size_t f = 1; f < pose_begin_.size(); ++f) pose_begin_[f] += pose_begin_[f - 1];
  pose_links_.resize(pose_begin_.back());
  auto next = pose_begin_;
  for (std::uint32_t k = 0; k < links_.size(); ++k) {
    if (links_[k].free_pose < 0) continue;
    pose_links_[next[static_cast<std::size_t>(links_[k].free_pose)]++] = k;
  }
}

void BundleSolver::find_blocks() {
  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> noted_by(free_poses_.size(), kNone);
  std::vector<std::uint32_t> columns;
  for (std::uint32_t row = 0; row < free_poses_.size(); ++row) {
    columns.clear();
    for (std::uint32_t k = pose_begin_[row]; k < pose_begin_[row + 1]; ++k) {
      const auto& point = points_[links_[pose_links_[k]].point];
      for (std::uint32_t b = point.begin; b < point.end; ++b) {
        if (links_[b].free_pose < static_cast<std::int32_t>(row)) continue;
        const auto column = static_cast<std::uint32_t>(links_[b].free_pose);
        if (std::exchange(noted_by[column], row) != row) columns.push_back(column);
      }
    }
    std::sort(columns.begin(), columns.end());
    row_begin_.push_back(static_cast<std::uint32_t>(blocks_.size()));
    for (const auto column : columns) blocks_.emplace_back(Block{.row = row, .column = column});
  }
  row_begin_.push_back(static_cast<std::uint32_t>(blocks_.size()));
  block_of_.resize(free_poses_.size());
}

double BundleSolver::cost() const {
  double sum = 0.0;
  for (const auto& point : points_) {
    for (std::uint32_t k = point.begin; k < point.end; ++k) {
      const auto& observation = problem_.observations[links_[k].observation];
      const auto residual = evaluate(problem_.poses[observation.pose].T_world_camera,
                                     problem_.points_world[observation.point],
                                     effective(observation),
                                     problem_.camera,
                                     problem_.depth_model);
      if (!residual) return std::numeric_limits<double>::infinity();
      sum += huber(residual->r.head<2>().squaredNorm(), config_.pixel_gate).value;
      sum += huber(residual->r[2] * residual->r[2], config_.depth_gate).value;
    }
  }
  return 0.5 * sum;
}

void BundleSolver::linearize() {
  std::fill(H_poses_.begin(), H_poses_.end(), Matrix6d::Zero());
  std::fill(g_poses_.begin(), g_poses_.end(), Vector6d::Zero());
  for (auto& point : points_) {
    point.H.setZero();
    point.g.setZero();
    for (std::uint32_t k = point.begin; k < point.end; ++k) {
      auto& link = links_[k];
      const auto& observation = problem_.observations[link.observation];
      const auto residual = evaluate(problem_.poses[observation.pose].T_world_camera,
                                     problem_.points_world[observation.point],
                                     effective(observation),
                                     problem_.camera,
                                     problem_.depth_model);
      if (!residual) continue;  // cost() was finite, so this does not happen
      const double pixel = huber(residual->r.head<2>().squaredNorm(), config_.pixel_gate).weight;
      const double depth = huber(residual->r[2] * residual->r[2], config_.depth_gate).weight;
      const Eigen::Vector3d weight(pixel, pixel, depth);
      const Eigen::Matrix3d WJ_point = weight.asDiagonal() * residual->J_point;
      point.H.noalias() += residual->J_point.transpose() * WJ_point;
      point.g.noalias() -= WJ_point.transpose() * residual->r;
      if (link.free_pose < 0) continue;
      const auto f = static_cast<std::size_t>(link.free_pose);
      const Eigen::Matrix<double, 3, 6> WJ_pose = weight.asDiagonal() * residual->J_pose;
      H_poses_[f].noalias() += residual->J_pose.transpose() * WJ_pose;
      g_poses_[f].noalias() -= WJ_pose.transpose() * residual->r;
      link.H_pose_point.noalias() = residual->J_pose.transpose() * WJ_point;
    }
  }
}

/// Eliminates the points: S = H_pp - H_pl H_ll^-1 H_lp, with Marquardt's damping of the diagonals.
void BundleSolver::reduce(double lambda) {
  g_reduced_.resize(6 * static_cast<Eigen::Index>(free_poses_.size()));
  for (auto& point : points_) {
    Eigen::Matrix3d H = point.H;
    H.diagonal() += lambda * point.H.diagonal() + Eigen::Vector3d::Constant(1e-9);
    point.H_inverse = H.inverse();
  }
  for (std::uint32_t row = 0; row < free_poses_.size(); ++row) reduce_row(row, lambda);
}

/// Row by row, so that a list as long as one row finds the blocks.
void BundleSolver::reduce_row(std::uint32_t row, double lambda) {
  for (std::uint32_t k = row_begin_[row]; k < row_begin_[row + 1]; ++k) {
    block_of_[blocks_[k].column] = k;
    blocks_[k].S.setZero();
  }
  auto& S = blocks_[block_of_[row]].S;
  S = H_poses_[row];
  S.diagonal() += lambda * H_poses_[row].diagonal() + Vector6d::Constant(1e-9);
  auto g = g_reduced_.segment<6>(6 * static_cast<Eigen::Index>(row));
  g = g_poses_[row];
  for (std::uint32_t k = pose_begin_[row]; k < pose_begin_[row + 1]; ++k) {
    const auto& link = links_[pose_links_[k]];
    const auto& point = points_[link.point];
    const Eigen::Vector3d moved = point.H_inverse * point.g;
    g.noalias() -= link.H_pose_point * moved;
    const Eigen::Matrix<double, 6, 3> Y = link.H_pose_point * point.H_inverse;
    for (std::uint32_t b = point.begin; b < point.end; ++b) {
      if (links_[b].free_pose < link.free_pose) continue;
      blocks_[block_of_[static_cast<std::size_t>(links_[b].free_pose)]].S.noalias() -=
          Y * links_[b].H_pose_point.transpose();
    }
  }
}

bool BundleSolver::solve_dense(Eigen::VectorXd& step) const {
  Eigen::MatrixXd S = Eigen::MatrixXd::Zero(g_reduced_.size(), g_reduced_.size());
  for (const auto& entry : blocks_) {
    S.block<6, 6>(6 * entry.row, 6 * entry.column) = entry.S;
  }
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Upper> cholesky(S);
  if (cholesky.info() != Eigen::Success) return false;
  step = cholesky.solve(g_reduced_);
  return true;
}

bool BundleSolver::solve_sparse(Eigen::VectorXd& step) const {
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(36 * blocks_.size());
  for (const auto& entry : blocks_) {
    for (int column = 0; column < 6; ++column) {
      for (int row = 0; row < 6; ++row) {
        const int i = static_cast<int>(6 * entry.row) + row;
        const int j = static_cast<int>(6 * entry.column) + column;
        if (i <= j) entries.emplace_back(i, j, entry.S(row, column));
      }
    }
  }
  Eigen::SparseMatrix<double> S(g_reduced_.size(), g_reduced_.size());
  S.setFromTriplets(entries.begin(), entries.end());
  Eigen::CholmodSupernodalLLT<Eigen::SparseMatrix<double>, Eigen::Upper> cholesky(S);
  if (cholesky.info() != Eigen::Success) return false;
  step = cholesky.solve(g_reduced_);
  return true;
}

bool BundleSolver::solve_poses() {
  const bool dense = static_cast<int>(free_poses_.size()) <= config_.max_dense_poses;
  const bool solved = dense ? solve_dense(step_poses_) : solve_sparse(step_poses_);
  return solved && step_poses_.allFinite();
}

void BundleSolver::solve_points() {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto& point = points_[i];
    Eigen::Vector3d g = point.g;
    for (std::uint32_t k = point.begin; k < point.end; ++k) {
      if (links_[k].free_pose < 0) continue;
      g.noalias() -=
          links_[k].H_pose_point.transpose() * step_poses_.segment<6>(6 * links_[k].free_pose);
    }
    step_points_[i] = point.H_inverse * g;
  }
}

/// What the quadratic model promises: step' (lambda D step + g) / 2.
double BundleSolver::predicted_decrease(double lambda) const {
  double sum = 0.0;
  for (std::size_t f = 0; f < free_poses_.size(); ++f) {
    const Vector6d step = step_poses_.segment<6>(6 * static_cast<Eigen::Index>(f));
    sum += step.dot(lambda * H_poses_[f].diagonal().cwiseProduct(step) + g_poses_[f]);
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto& step = step_points_[i];
    sum += step.dot(lambda * points_[i].H.diagonal().cwiseProduct(step) + points_[i].g);
  }
  return 0.5 * sum;
}

void BundleSolver::apply_step() {
  old_poses_.clear();
  old_points_.clear();
  for (std::size_t f = 0; f < free_poses_.size(); ++f) {
    auto& T = problem_.poses[free_poses_[f]].T_world_camera;
    old_poses_.push_back(T);
    T = geometry::retract(T, step_poses_.segment<6>(6 * static_cast<Eigen::Index>(f)));
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    auto& p = problem_.points_world[points_[i].index];
    old_points_.push_back(p);
    p += step_points_[i];
  }
}

void BundleSolver::undo_step() {
  for (std::size_t f = 0; f < free_poses_.size(); ++f) {
    problem_.poses[free_poses_[f]].T_world_camera = old_poses_[f];
  }
  for (std::size_t i = 0; i < points_.size(); ++i) {
    problem_.points_world[points_[i].index] = old_points_[i];
  }
}

int BundleSolver::run(int max_iterations, const std::atomic<bool>* stop) {
  double lambda = kFirstLambda;
  double growth = 2.0;  // Nielsen's rule (Madsen, Nielsen, Tingleff, 2004, section 3.2)
  double current = cost();
  bool moved = true;
  int iteration = 0;
  while (iteration < max_iterations && lambda < kMaxLambda && std::isfinite(current)) {
    if (stop != nullptr && stop->load(std::memory_order_relaxed)) break;
    ++iteration;
    if (moved) linearize();
    reduce(lambda);
    moved = false;
    if (solve_poses()) {
      solve_points();
      apply_step();
      const double next = cost();
      const double gain = (current - next) / predicted_decrease(lambda);
      if (next < current) {
        const bool flat = current - next <= config_.relative_cost_change * current;
        current = next;
        moved = true;
        lambda *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
        growth = 2.0;
        if (flat) break;
        continue;
      }
      undo_step();
      if (current - next >= -1e-12 * current) break;  // at the minimum to rounding
    }
    lambda *= growth;
    growth *= 2.0;
  }
  return iteration;
}

}  // namespace camvox::optimization::internal
