#include "camvox/optimization/pose_graph.hpp"

#include <ceres/ceres.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>

namespace camvox::optimization {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

/// A pose as Ceres holds it: [qx qy qz qw x y z].
using Block = std::array<double, 7>;

Block to_block(const SE3& T) {
  const auto& q = T.rotation().quaternion();
  const auto& t = T.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

SE3 to_se3(const double* block) {
  return {geometry::SO3(Eigen::Quaterniond(block[3], block[0], block[1], block[2])),
          Eigen::Vector3d(block[4], block[5], block[6])};
}

/// Our convention for Ceres: right perturbation, [rotation; translation]. Cost functions write
/// their Jacobian over xi into the first six columns of the 7-column block and leave the last one
/// zero, so that the plus Jacobian is [I; 0].
class Se3Manifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }

  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const Eigen::Map<const Vector6d> xi(delta);
    if (!xi.allFinite()) return false;
    const Block moved = to_block(geometry::retract(to_se3(x), xi));
    std::copy(moved.begin(), moved.end(), x_plus_delta);
    return true;
  }

  bool PlusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>> J(jacobian);
    J.setIdentity();
    return true;
  }

  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d> xi(y_minus_x);
    xi = geometry::local(to_se3(x), to_se3(y));
    return true;
  }

  bool MinusJacobian(const double* /*x*/, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>> J(jacobian);
    J.setIdentity();
    return true;
  }
};

class RelativePoseCost final : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit RelativePoseCost(const PoseGraphEdge& edge) : T_from_to_(edge.T_from_to) {
    const Eigen::LLT<Matrix6d> cholesky(edge.covariance_to);
    if (cholesky.info() != Eigen::Success || !edge.covariance_to.allFinite()) {
      throw std::logic_error("pose graph: covariance of edge " + std::to_string(edge.from) +
                             " -> " + std::to_string(edge.to) + " is not positive definite");
    }
    weight_ = cholesky.matrixL().solve(Matrix6d::Identity());
  }

  bool Evaluate(double const* const* poses, double* residuals, double** jacobians) const override {
    using RowMajor = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;
    const SE3 T_map_from = to_se3(poses[0]), T_map_to = to_se3(poses[1]);
    Eigen::Map<Vector6d> weighted(residuals);
    if (jacobians == nullptr) {
      weighted = weight_ * relative_pose_residual(T_map_from, T_map_to, T_from_to_);
      return true;
    }
    const auto result = evaluate_relative_pose(T_map_from, T_map_to, T_from_to_);
    weighted = weight_ * result.r;
    if (jacobians[0] != nullptr) {
      Eigen::Map<RowMajor> J(jacobians[0]);
      J.leftCols<6>() = weight_ * result.J_from;
      J.col(6).setZero();
    }
    if (jacobians[1] != nullptr) {
      Eigen::Map<RowMajor> J(jacobians[1]);
      J.leftCols<6>() = weight_ * result.J_to;
      J.col(6).setZero();
    }
    return true;
  }

 private:
  SE3 T_from_to_;
  Matrix6d weight_;  ///< weight_^T weight_ is the inverse covariance.
};

void check(const PoseGraph& graph) {
  if (graph.fixed.size() != graph.T_map_node.size()) {
    throw std::logic_error("pose graph: one `fixed` per node");
  }
  if (std::find(graph.fixed.begin(), graph.fixed.end(), true) == graph.fixed.end()) {
    throw std::logic_error("pose graph: no node is fixed");
  }
  for (const auto& edge : graph.edges) {
    if (edge.from >= graph.fixed.size() || edge.to >= graph.fixed.size() || edge.from == edge.to) {
      throw std::logic_error("pose graph: edge between nodes that do not exist");
    }
  }
}

ceres::Solver::Options solver_options(const PoseGraphConfig& config) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.sparse_linear_algebra_library_type = ceres::SUITE_SPARSE;
  options.max_num_iterations = config.max_iterations;
  options.function_tolerance = config.relative_tolerance;
  options.initial_trust_region_radius = 1e8;  // odometry is a good start: nearly Gauss-Newton
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  return options;
}

/// One pass over the edges that are still in.
PoseGraphSolution solve_once(const PoseGraph& graph,
                             const PoseGraphConfig& config,
                             const std::vector<SE3>& start,
                             const std::vector<bool>& left_out) {
  std::vector<Block> blocks;
  for (const auto& T : start) blocks.push_back(to_block(T));
  Se3Manifold manifold;
  ceres::CauchyLoss kernel(config.kernel_width_sigma);
  ceres::Problem::Options problem_options;
  problem_options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  problem_options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    problem.AddParameterBlock(blocks[i].data(), 7, &manifold);
    if (graph.fixed[i]) problem.SetParameterBlockConstant(blocks[i].data());
  }
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    if (left_out[i]) continue;
    const auto& edge = graph.edges[i];
    problem.AddResidualBlock(new RelativePoseCost(edge),
                             edge.robust ? &kernel : nullptr,
                             blocks[edge.from].data(),
                             blocks[edge.to].data());
  }
  ceres::Solver::Summary report;
  ceres::Solve(solver_options(config), &problem, &report);

  PoseGraphSolution solution;
  solution.summary.nodes = graph.T_map_node.size();
  solution.summary.edges = graph.edges.size();
  solution.summary.iterations = static_cast<int>(report.iterations.size());
  solution.summary.cost_before = report.initial_cost;
  solution.summary.cost_after = report.final_cost;
  solution.summary.usable = report.IsSolutionUsable();
  if (!solution.summary.usable) {
    solution.T_map_node = graph.T_map_node;
    return solution;
  }
  for (const auto& block : blocks) solution.T_map_node.push_back(to_se3(block.data()));
  return solution;
}

/// Squared distance of an edge from the poses, in sigma.
double squared_distance(const PoseGraphEdge& edge, const std::vector<SE3>& T_map_node) {
  const Vector6d r =
      relative_pose_residual(T_map_node[edge.from], T_map_node[edge.to], edge.T_from_to);
  return r.dot(edge.covariance_to.llt().solve(r));
}

/// Cauchy's, as ceres::CauchyLoss.
double kernel(double squared, const PoseGraphConfig& config) {
  const double squared_width = config.kernel_width_sigma * config.kernel_width_sigma;
  return squared_width * std::log1p(squared / squared_width);
}

}  // namespace

std::string PoseGraphSummary::to_string() const {
  std::array<char, 160> text{};
  std::snprintf(
      text.data(),
      text.size(),
      "pose graph: %zu poses, %zu edges, %zu left out, cost %.4g -> %.4g in %d iterations%s",
      nodes,
      edges,
      outliers,
      cost_before,
      cost_after,
      iterations,
      usable ? "" : ", NOT usable");
  return text.data();
}

Vector6d relative_pose_residual(const SE3& T_map_from, const SE3& T_map_to, const SE3& T_from_to) {
  return (T_from_to.inverse() * (T_map_from.inverse() * T_map_to)).log();
}

RelativePoseResidual evaluate_relative_pose(const SE3& T_map_from,
                                            const SE3& T_map_to,
                                            const SE3& T_from_to) {
  RelativePoseResidual result;
  result.r = relative_pose_residual(T_map_from, T_map_to, T_from_to);
  result.J_to = SE3::right_jacobian_inverse(result.r);
  result.J_from = -result.J_to * (T_map_to.inverse() * T_map_from).adjoint();
  return result;
}

double cost(const PoseGraph& graph,
            const std::vector<SE3>& T_map_node,
            const PoseGraphConfig& config) {
  double sum = 0.0;
  for (const auto& edge : graph.edges) {
    const double squared = squared_distance(edge, T_map_node);
    sum += edge.robust ? kernel(squared, config) : squared;
  }
  return 0.5 * sum;
}

double cost_of_doubt(const PoseGraphConfig& config) {
  return 0.5 * kernel(config.kernel_width_sigma * config.kernel_width_sigma, config);
}

PoseGraphSolution solve_with_all_edges(const PoseGraph& graph, const PoseGraphConfig& config) {
  check(graph);
  return solve_once(graph, config, graph.T_map_node, std::vector<bool>(graph.edges.size(), false));
}

PoseGraphSolution leave_out_outliers(const PoseGraph& graph,
                                     const PoseGraphSolution& solution,
                                     const PoseGraphConfig& config) {
  if (!solution.summary.usable) return solution;
  const double limit = config.outlier_sigma * config.outlier_sigma;
  std::vector<bool> left_out(graph.edges.size(), false);
  std::vector<std::size_t> outliers;
  for (std::size_t i = 0; i < graph.edges.size(); ++i) {
    const auto& edge = graph.edges[i];
    if (!edge.robust || !(squared_distance(edge, solution.T_map_node) > limit)) continue;
    left_out[i] = true;
    outliers.push_back(i);
  }
  if (outliers.empty()) return solution;
  auto result = solve_once(graph, config, solution.T_map_node, left_out);
  result.summary.iterations += solution.summary.iterations;
  result.summary.cost_before = solution.summary.cost_before;
  result.summary.outliers = outliers.size();
  result.outliers = std::move(outliers);
  return result;
}

PoseGraphSolution solve(const PoseGraph& graph, const PoseGraphConfig& config) {
  return leave_out_outliers(graph, solve_with_all_edges(graph, config), config);
}

}  // namespace camvox::optimization
