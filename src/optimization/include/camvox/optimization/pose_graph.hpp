#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"

namespace camvox::optimization {

/// A measured pose of one node in the frame of another.
struct PoseGraphEdge {
  std::size_t from = 0;  ///< Index of a node.
  std::size_t to = 0;    ///< Index of another node.
  geometry::SE3 T_from_to;
  /// Of T_from_to * exp(xi), xi = [rotation; translation].
  geometry::Matrix6d covariance_to = geometry::Matrix6d::Identity();
  bool robust = false;  ///< May be wrong (a loop): gets a robust kernel and may be left out.
};

/// Poses to find, and what is known about them.
struct PoseGraph {
  std::vector<geometry::SE3> T_map_node;  ///< Where to start from.
  std::vector<bool> fixed;                ///< One per node; at least one true in each component.
  std::vector<PoseGraphEdge> edges;
};

/// Tuning of solve(). YAML keys are the field names.
struct PoseGraphConfig {
  int max_iterations = 30;
  double relative_tolerance = 1e-5;  ///< Stop when a step gains less than this part of the cost.
  double kernel_width_sigma = 2.0;   ///< Of the Cauchy kernel on robust edges.
  double outlier_sigma = 5.0;        ///< A robust edge farther off than this is left out.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("max_iterations", self.max_iterations, config::at_least(1), config::at_most(1000));
    field("relative_tolerance", self.relative_tolerance, config::greater_than(0.0));
    field("kernel_width_sigma", self.kernel_width_sigma, config::greater_than(0.0));
    field("outlier_sigma", self.outlier_sigma, config::greater_than(0.0));
  }
};

/// What solving did; to_string() is one line for the log.
struct PoseGraphSummary {
  std::size_t nodes = 0;
  std::size_t edges = 0;
  std::size_t outliers = 0;
  int iterations = 0;
  double cost_before = 0.0;  ///< Half the sum of squares in sigma, kernel included.
  double cost_after = 0.0;
  bool usable = false;  ///< The poses are finite and no worse than before.

  [[nodiscard]] std::string to_string() const;
};

struct PoseGraphSolution {
  std::vector<geometry::SE3> T_map_node;
  std::vector<std::size_t> outliers;  ///< Robust edges that were left out, as indices.
  PoseGraphSummary summary;
};

/// Distance of an edge's measurement from two poses, and how it moves.
struct RelativePoseResidual {
  geometry::Vector6d r;       ///< log(T_from_to^-1 T_map_from^-1 T_map_to), not weighted.
  geometry::Matrix6d J_from;  ///< d r / d xi for T_map_from * exp(xi).
  geometry::Matrix6d J_to;    ///< d r / d xi for T_map_to * exp(xi).
};
[[nodiscard]] geometry::Vector6d relative_pose_residual(const geometry::SE3& T_map_from,
                                                        const geometry::SE3& T_map_to,
                                                        const geometry::SE3& T_from_to);
[[nodiscard]] RelativePoseResidual evaluate_relative_pose(const geometry::SE3& T_map_from,
                                                          const geometry::SE3& T_map_to,
                                                          const geometry::SE3& T_from_to);

/// Finds the poses that agree best with the edges: Levenberg-Marquardt on SE(3) (Ceres, sparse
/// Cholesky of SuiteSparse) with analytic Jacobians. Robust edges that disagree with the result by
/// more than outlier_sigma are left out and the rest is solved again. One thread; the same graph
/// gives the same bytes. Without a solution the poses are those given, and usable is false.
/// Throws std::logic_error for an index out of range, no fixed node, or a covariance that is not
/// positive definite.
[[nodiscard]] PoseGraphSolution solve(const PoseGraph& graph, const PoseGraphConfig& config = {});

/// Half the sum of squares in sigma, kernel included, as in PoseGraphSummary.
[[nodiscard]] double cost(const PoseGraph& graph,
                          const std::vector<geometry::SE3>& T_map_node,
                          const PoseGraphConfig& config = {});

/// The least that a robust edge costs which is beyond the width of its kernel. Below it the kernel
/// is convex: two different solutions differ in which edges are beyond, so that one of less than
/// this cost is the best of all.
[[nodiscard]] double cost_of_doubt(const PoseGraphConfig& config);

/// The two halves of solve(), for who compares solutions in between: all edges stay in, with the
/// kernel on the robust ones; then those that disagree are left out.
[[nodiscard]] PoseGraphSolution solve_with_all_edges(const PoseGraph& graph,
                                                     const PoseGraphConfig& config = {});
[[nodiscard]] PoseGraphSolution leave_out_outliers(const PoseGraph& graph,
                                                   const PoseGraphSolution& solution,
                                                   const PoseGraphConfig& config = {});

}  // namespace camvox::optimization
