#include "camvox/optimization/pose_graph.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <stdexcept>

namespace camvox::optimization {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

Vector6d random_twist(std::mt19937& random, double rotation_rad, double translation_m) {
  std::normal_distribution<double> unit;
  Vector6d xi;
  for (int i = 0; i < 6; ++i) xi[i] = unit(random) * (i < 3 ? rotation_rad : translation_m);
  return xi;
}

Matrix6d covariance(double rotation_rad, double translation_m) {
  Vector6d sigma;
  sigma << rotation_rad, rotation_rad, rotation_rad, translation_m, translation_m, translation_m;
  return sigma.cwiseAbs2().asDiagonal();
}

/// A drive around a circle and on over its beginning, with noisy odometry and exact loops.
struct Circuit {
  explicit Circuit(std::size_t nodes, unsigned seed = 3) {
    std::mt19937 random(seed);
    const std::size_t period = nodes * 4 / 5;
    const double step_rad = 2.0 * M_PI / static_cast<double>(period);
    for (std::size_t i = 0; i < nodes; ++i) {
      const double angle = step_rad * static_cast<double>(i);
      truth.emplace_back(geometry::SO3::exp({0.0, 0.0, angle}),
                         Eigen::Vector3d(60.0 * std::sin(angle), 60.0 - 60.0 * std::cos(angle), 0));
    }
    graph.T_map_node = {truth[0]};
    for (std::size_t i = 1; i < nodes; ++i) {
      const SE3 T = truth[i - 1].inverse() * truth[i] * SE3::exp(random_twist(random, 2e-3, 0.02));
      graph.edges.push_back({i - 1, i, T, covariance(2e-3, 0.02), false});
      graph.T_map_node.push_back(graph.T_map_node.back() * T);
    }
    graph.fixed.assign(nodes, false);
    graph.fixed[0] = true;
    for (std::size_t i = period; i < nodes; i += 5) {
      const SE3 T = truth[i - period].inverse() * truth[i];
      graph.edges.push_back({i - period, i, T, covariance(1e-3, 0.02), true});
    }
  }

  [[nodiscard]] double rmse_m(const std::vector<SE3>& poses) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }

  std::vector<SE3> truth;
  PoseGraph graph;
};

// Central differences with a step of 1e-6 are good to about 1e-9 of the size of the values.
TEST(PoseGraphTest, JacobiansAgreeWithFiniteDifferences) {
  std::mt19937 random(5);
  constexpr double kStep = 1e-6;
  for (int i = 0; i < 50; ++i) {
    const SE3 T_from = SE3::exp(random_twist(random, 0.8, 5.0));
    const SE3 T_to = SE3::exp(random_twist(random, 0.8, 5.0));
    const SE3 measured = T_from.inverse() * T_to * SE3::exp(random_twist(random, 0.3, 1.0));
    const auto result = evaluate_relative_pose(T_from, T_to, measured);
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      const auto difference = [&](const auto& at) -> Vector6d {
        return (at(step) - at(Vector6d(-step))) / (2.0 * kStep);
      };
      const Vector6d from = difference([&](const Vector6d& xi) -> Vector6d {
        return evaluate_relative_pose(geometry::retract(T_from, xi), T_to, measured).r;
      });
      const Vector6d to = difference([&](const Vector6d& xi) -> Vector6d {
        return evaluate_relative_pose(T_from, geometry::retract(T_to, xi), measured).r;
      });
      EXPECT_LT((result.J_from.col(k) - from).norm(), 1e-6 * (1.0 + from.norm()));
      EXPECT_LT((result.J_to.col(k) - to).norm(), 1e-6 * (1.0 + to.norm()));
    }
  }
}

TEST(PoseGraphTest, ClosesACircuit) {
  const Circuit circuit(200);
  const auto solution = solve(circuit.graph);
  EXPECT_TRUE(solution.summary.usable) << solution.summary.to_string();
  EXPECT_TRUE(solution.outliers.empty());
  EXPECT_LT(solution.summary.cost_after, solution.summary.cost_before);
  // Odometry of 200 steps leaves 2 to 3 m; between loops at both ends of 160 steps of 2 cm and
  // 2 mrad a bridge of that random walk is left, about a fifth.
  EXPECT_LT(circuit.rmse_m(solution.T_map_node), 0.35 * circuit.rmse_m(circuit.graph.T_map_node));
}

// Exact measurements: the answer is known.
TEST(PoseGraphTest, FindsExactPoses) {
  Circuit circuit(50);
  std::mt19937 random(9);
  for (auto& edge : circuit.graph.edges) {
    edge.T_from_to = circuit.truth[edge.from].inverse() * circuit.truth[edge.to];
  }
  for (std::size_t i = 1; i < 50; ++i) {
    circuit.graph.T_map_node[i] = circuit.truth[i] * SE3::exp(random_twist(random, 0.02, 0.2));
  }
  circuit.graph.T_map_node[0] = circuit.truth[0];
  PoseGraphConfig config;
  config.relative_tolerance = 1e-12;
  EXPECT_LT(circuit.rmse_m(solve(circuit.graph, config).T_map_node), 1e-6);
}

// Two measurements of one pose: the answer is the mean weighted with the inverse covariances.
TEST(PoseGraphTest, WeighsByCovariance) {
  PoseGraph graph;
  graph.T_map_node.resize(2);
  graph.fixed = {true, false};
  graph.edges.push_back({0, 1, SE3({}, {1.0, 0.0, 0.0}), covariance(0.01, 0.1), false});
  graph.edges.push_back({0, 1, SE3({}, {2.0, 0.0, 0.0}), covariance(0.01, 0.2), false});
  const auto solution = solve(graph);
  EXPECT_NEAR(solution.T_map_node[1].translation().x(), (1.0 / 0.01 + 2.0 / 0.04) / 125.0, 1e-6);
}

TEST(PoseGraphTest, LeavesOutAWrongLoop) {
  Circuit circuit(200);
  const auto clean = solve(circuit.graph);
  const auto wrong = circuit.graph.edges.size();
  circuit.graph.edges.push_back({20, 90, SE3(), covariance(1e-3, 0.02), true});
  const auto solution = solve(circuit.graph);
  EXPECT_EQ(solution.outliers, std::vector<std::size_t>{wrong});
  EXPECT_NEAR(circuit.rmse_m(solution.T_map_node), circuit.rmse_m(clean.T_map_node), 1e-3);
}

TEST(PoseGraphTest, CostIsTheSolvers) {
  const Circuit circuit(200);
  const auto solution = solve_with_all_edges(circuit.graph);
  const auto& summary = solution.summary;
  const double before = cost(circuit.graph, circuit.graph.T_map_node);
  EXPECT_NEAR(before, summary.cost_before, 1e-9 * before);
  EXPECT_NEAR(cost(circuit.graph, solution.T_map_node), summary.cost_after, 1e-6 * before);
}

// One robust edge of 1 m a sigma. Its cost over the distance bends the other way at the width.
TEST(PoseGraphTest, DoubtBeginsWhereTheKernelIsNoLongerConvex) {
  PoseGraphConfig config;
  config.kernel_width_sigma = 3.0;
  PoseGraph graph;
  graph.fixed = {true, false};
  graph.edges.push_back({0, 1, SE3(), Matrix6d::Identity(), true});
  const auto cost_at = [&](double x_m) {
    return cost(graph, {SE3(), SE3({}, {x_m, 0.0, 0.0})}, config);
  };
  const auto bend = [&](double x_m) {
    return cost_at(x_m - 0.01) - 2.0 * cost_at(x_m) + cost_at(x_m + 0.01);
  };
  EXPECT_NEAR(cost_of_doubt(config), cost_at(3.0), 1e-12);
  EXPECT_GT(bend(2.95), 0.0);
  EXPECT_LT(bend(3.05), 0.0);
}

TEST(PoseGraphTest, RepeatsBitForBit) {
  const Circuit circuit(120);
  const auto first = solve(circuit.graph);
  const auto second = solve(circuit.graph);
  for (std::size_t i = 0; i < 120; ++i) {
    EXPECT_EQ(first.T_map_node[i].matrix(), second.T_map_node[i].matrix());
  }
}

TEST(PoseGraphTest, NothingToDo) {
  PoseGraph graph;
  graph.T_map_node.resize(1);
  graph.fixed = {true};
  const auto solution = solve(graph);
  EXPECT_TRUE(solution.summary.usable);
  EXPECT_EQ(solution.T_map_node[0].matrix(), SE3().matrix());
}

TEST(PoseGraphTest, RefusesMistakes) {
  Circuit circuit(10);
  circuit.graph.fixed[0] = false;
  EXPECT_THROW((void)solve(circuit.graph), std::logic_error);
  circuit.graph.fixed[0] = true;
  circuit.graph.edges[0].covariance_to.setZero();
  EXPECT_THROW((void)solve(circuit.graph), std::logic_error);
  circuit.graph.edges[0].covariance_to.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_THROW((void)solve(circuit.graph), std::logic_error);
  circuit.graph.edges[0] = {3, 99, SE3(), covariance(0.01, 0.1), false};
  EXPECT_THROW((void)solve(circuit.graph), std::logic_error);
}

}  // namespace
}  // namespace camvox::optimization
