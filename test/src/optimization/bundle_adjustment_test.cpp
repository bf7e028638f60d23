#include "camvox/optimization/bundle_adjustment.hpp"

#include <ceres/ceres.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <array>
#include <cstring>
#include <deque>
#include <numeric>

#include "bundle_world.hpp"

namespace camvox::optimization {
namespace {

using geometry::SE3;

class DepthModelTest : public testing::TestWithParam<DepthModel> {};

// Exact observations: the truth is the only optimum, and rounding is all that may be left.
TEST_P(DepthModelTest, FindsTheTruthOfExactObservations) {
  auto world = make_bundle_world({.noise_sigmas = 0.0}, 1);
  world.problem.depth_model = GetParam();
  BundleAdjustmentConfig config;
  config.relative_cost_change = 0.0;
  // Huber's kernel holds far starts back; the second round begins near.
  config.first_iterations = 20;
  config.second_iterations = 20;
  const auto summary = adjust(world.problem, config);
  EXPECT_EQ(summary.status, BundleSummary::Status::kConverged);
  EXPECT_LT(summary.cost_after, 1e-12);
  EXPECT_LT(worst_position_m(world), 1e-7);
  EXPECT_EQ(summary.outliers, 0U);
  for (std::size_t j = 0; j < world.points_world.size(); ++j) {
    const bool seen = std::any_of(world.problem.observations.begin(),
                                  world.problem.observations.end(),
                                  [&](const auto& o) { return o.point == j; });
    if (seen) {
      EXPECT_LT((world.problem.points_world[j] - world.points_world[j]).norm(), 1e-5);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both,
                         DepthModelTest,
                         testing::Values(DepthModel::kMetric, DepthModel::kVirtualStereo));

/// The same residuals for Ceres with numeric derivatives over rotation vector and translation.
struct CeresCost {
  BundleObservation seen;
  BundleProblem const* problem;
  bool depth;

  bool operator()(const double* pose, const double* point, double* r) const {
    const SE3 T(geometry::SO3::exp(Eigen::Map<const Eigen::Vector3d>(pose)),
                Eigen::Map<const Eigen::Vector3d>(pose + 3));
    const auto residual = evaluate(T,
                                   Eigen::Map<const Eigen::Vector3d>(point),
                                   seen.observation,
                                   problem->camera,
                                   problem->depth_model);
    if (!residual) return false;
    r[0] = depth ? residual->r[2] : residual->r[0];
    r[1] = depth ? 0.0 : residual->r[1];
    return true;
  }
};

/// Cost and poses at Ceres' optimum, or after so many iterations.
std::pair<double, std::vector<SE3>> solve_with_ceres(const BundleProblem& problem,
                                                     const BundleAdjustmentConfig& config,
                                                     int iterations = 100) {
  std::vector<std::array<double, 6>> poses;
  for (const auto& pose : problem.poses) {
    const Eigen::Vector3d w = pose.T_world_camera.rotation().log();
    const Eigen::Vector3d& t = pose.T_world_camera.translation();
    poses.push_back({w.x(), w.y(), w.z(), t.x(), t.y(), t.z()});
  }
  auto points = problem.points_world;
  ceres::Problem ceres_problem;
  for (const auto& seen : problem.observations) {
    for (const bool depth : {false, true}) {
      if (depth && seen.observation.depth_m <= 0.0) continue;
      auto* cost = new ceres::NumericDiffCostFunction<CeresCost, ceres::CENTRAL, 2, 6, 3>(
          new CeresCost{seen, &problem, depth});
      auto* kernel = new ceres::HuberLoss(std::sqrt(depth ? config.depth_gate : config.pixel_gate));
      ceres_problem.AddResidualBlock(
          cost, kernel, poses[seen.pose].data(), points[seen.point].data());
    }
  }
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (problem.poses[i].fixed) ceres_problem.SetParameterBlockConstant(poses[i].data());
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.max_num_iterations = iterations;
  options.function_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &ceres_problem, &summary);
  std::vector<SE3> result;
  for (const auto& pose : poses) {
    result.emplace_back(geometry::SO3::exp(Eigen::Map<const Eigen::Vector3d>(pose.data())),
                        Eigen::Map<const Eigen::Vector3d>(pose.data() + 3));
  }
  return {summary.final_cost, result};
}

// A second library, numeric derivatives, another parameterisation: the same minimum. It pins the
// right perturbation and the kernels. The cost is flat there: 1e-8 of it is about 1e-5 m.
TEST(BundleAdjustmentTest, AgreesWithCeres) {
  auto world = make_bundle_world({.free_poses = 5, .points = 150}, 2);
  BundleAdjustmentConfig config;
  config.relative_cost_change = 0.0;
  config.first_iterations = 100;
  config.second_iterations = 0;
  const auto [cost, T_world_camera] = solve_with_ceres(world.problem, config);
  const auto summary = adjust(world.problem, config);
  EXPECT_NEAR(solve_with_ceres(world.problem, config, 0).first, cost, 1e-7 * cost);
  EXPECT_GT(summary.outliers + summary.depth_outliers, 0U);
  EXPECT_LT(summary.cost_after, cost) << "what was flagged does not count";
  for (std::size_t i = 0; i < T_world_camera.size(); ++i) {
    EXPECT_LT(geometry::local(world.problem.poses[i].T_world_camera, T_world_camera[i]).norm(),
              1e-4);
  }
}

// 1.5 px and 9 cm would be three sigma; ten observations a pose average that down.
TEST(BundleAdjustmentTest, StaysNearTheTruthInNoise) {
  auto world = make_bundle_world({}, 3);
  const double before = worst_position_m(world);
  const auto summary = adjust(world.problem);
  EXPECT_LT(summary.cost_after, summary.cost_before);
  EXPECT_GT(before, 0.03);
  EXPECT_LT(worst_position_m(world), 0.015);
}

TEST(BundleAdjustmentTest, FlagsWrongPixelsAndWrongDepthsApart) {
  auto world = make_bundle_world({.noise_sigmas = 0.3}, 4);
  std::vector<std::size_t> wrong_pixels;
  std::vector<std::size_t> wrong_depths;
  for (std::size_t i = 0; i < world.problem.observations.size(); i += 20) {
    auto& seen = world.problem.observations[i].observation;
    if (i % 40 == 0) {
      seen.u_px.x() += 30.0;
      wrong_pixels.push_back(i);
    } else if (seen.depth_m > 0.0) {
      seen.depth_m += 3.0;
      wrong_depths.push_back(i);
    }
  }
  const auto summary = adjust(world.problem);
  for (const auto i : wrong_pixels) EXPECT_TRUE(world.problem.observations[i].outlier) << i;
  for (const auto i : wrong_depths) {
    EXPECT_TRUE(world.problem.observations[i].depth_outlier) << i;
    EXPECT_FALSE(world.problem.observations[i].outlier) << i;
  }
  EXPECT_LT(worst_position_m(world), 0.01);
  // A point with two views can satisfy a wrong one, and then another view looks wrong.
  EXPECT_LT(summary.outliers, 2 * wrong_pixels.size());
}

// Residuals of points that came close to a camera grow without bound once nothing holds them.
TEST(BundleAdjustmentTest, GrossOutliersDoNotHideTheGain) {
  auto world = make_bundle_world({}, 7);
  const auto clean = adjust(world.problem);
  world = make_bundle_world({}, 7);
  for (std::size_t i = 0; i < world.problem.observations.size(); i += 100) {
    world.problem.observations[i].observation.u_px.x() += 1e5;
  }
  const auto summary = adjust(world.problem);
  EXPECT_LT(summary.cost_after, summary.cost_before);
  EXPECT_NEAR(summary.cost_after, clean.cost_after, 0.1 * clean.cost_after);
}

TEST(BundleAdjustmentTest, LeavesFlaggedObservationsOut) {
  auto world = make_bundle_world({.noise_sigmas = 0.0, .start_noise = 0.0}, 5);
  for (std::size_t i = 0; i < world.problem.observations.size(); i += 10) {
    world.problem.observations[i].observation.u_px.x() += 500.0;
    world.problem.observations[i].outlier = true;
  }
  const auto summary = adjust(world.problem);
  EXPECT_LT(summary.cost_before, 1e-12);
  EXPECT_LT(worst_position_m(world), 1e-9);
}

TEST(BundleAdjustmentTest, SparseAndDenseAgree) {
  const auto start = make_bundle_world({.free_poses = 30, .points = 900}, 6);
  BundleAdjustmentConfig config;
  config.relative_cost_change = 0.0;
  auto dense = start;
  auto sparse = start;
  const auto dense_summary = adjust(dense.problem, config);
  config.max_dense_poses = 0;
  const auto sparse_summary = adjust(sparse.problem, config);
  EXPECT_NEAR(sparse_summary.cost_after, dense_summary.cost_after, 1e-9 * dense_summary.cost_after);
  for (std::size_t i = 0; i < dense.problem.poses.size(); ++i) {
    const auto& a = dense.problem.poses[i].T_world_camera;
    const auto& b = sparse.problem.poses[i].T_world_camera;
    EXPECT_LT(geometry::local(a, b).norm(), 1e-6);
  }
}

// A street: each pose shares points with the next one only. A table of all pairs of 10 000 poses
// alone takes 400 MB, what is needed with 100 000 observations 70 MB.
TEST(BundleAdjustmentTest, MemoryGrowsWithTheObservations) {
  BundleProblem street;
  street.camera = {700.0, 710.0, 620.0, 187.0, 0.05};
  for (std::uint32_t i = 0; i < 10000; ++i) {
    street.poses.push_back({SE3({}, {0.0, 0.0, 1.0 * i}), i == 0});
    if (i == 0) continue;
    for (int k = 0; k < 5; ++k) {
      const auto point = static_cast<std::uint32_t>(street.points_world.size());
      street.points_world.emplace_back(k - 2.0, 0.5 * k - 1.0, 9.0 + i);
      for (const auto pose : {i - 1, i}) {
        BundleObservation seen{.pose = pose, .point = point, .observation = {}};
        const Eigen::Vector3d p =
            street.poses[pose].T_world_camera.inverse() * street.points_world.back();
        seen.observation.u_px = {700.0 * p.x() / p.z() + 620.0, 710.0 * p.y() / p.z() + 187.0};
        seen.observation.depth_m = p.z();
        seen.observation.sigma_depth_m = 0.03;
        street.observations.push_back(seen);
      }
    }
  }
  const auto peak_mb = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss / 1024;
  };
  const auto before_mb = peak_mb();
  EXPECT_EQ(adjust(street, {.first_iterations = 1, .second_iterations = 1}).outliers, 0U);
  EXPECT_LT(peak_mb() - before_mb, 300);
}

TEST(BundleAdjustmentTest, RepeatsItselfToTheBit) {
  for (const int max_dense_poses : {0, 100}) {
    BundleAdjustmentConfig config;
    config.max_dense_poses = max_dense_poses;
    auto first = make_bundle_world({.free_poses = 20, .points = 600}, 7);
    auto second = make_bundle_world({.free_poses = 20, .points = 600}, 7);
    (void)adjust(first.problem, config);
    (void)adjust(second.problem, config);
    for (std::size_t j = 0; j < first.problem.points_world.size(); ++j) {
      EXPECT_EQ(0,
                std::memcmp(first.problem.points_world[j].data(),
                            second.problem.points_world[j].data(),
                            sizeof(Eigen::Vector3d)));
    }
  }
}

TEST(BundleAdjustmentTest, StopsWhenAsked) {
  auto world = make_bundle_world({}, 8);
  const auto start = world.problem.poses.back().T_world_camera;
  const std::atomic<bool> stop = true;
  const auto summary = adjust(world.problem, {}, &stop);
  EXPECT_EQ(summary.status, BundleSummary::Status::kInterrupted);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_EQ(summary.outliers + summary.depth_outliers, 0U) << "where it starts says nothing";
  EXPECT_EQ(geometry::local(start, world.problem.poses.back().T_world_camera).norm(), 0.0);
}

TEST(BundleAdjustmentTest, TakesOutWhatIsBehindACameraOrNaN) {
  auto world = make_bundle_world({.noise_sigmas = 0.0}, 9);
  const auto first = world.problem.observations[0].point;
  const auto second = world.problem.observations.back().point;
  world.problem.points_world[first] = {0.0, 0.0, -50.0};
  world.problem.points_world[second].setConstant(std::numeric_limits<double>::quiet_NaN());
  const auto summary = adjust(world.problem);
  EXPECT_EQ(summary.status, BundleSummary::Status::kConverged);
  EXPECT_TRUE(world.problem.observations[0].outlier);
  EXPECT_TRUE(world.problem.observations.back().outlier);
  EXPECT_LT(worst_position_m(world), 1e-3);
}

TEST(BundleAdjustmentTest, EmptyInputAndFixedPosesAreNothingToDo) {
  BundleProblem empty;
  EXPECT_EQ(adjust(empty).status, BundleSummary::Status::kNothingToDo);
  auto fixed = make_bundle_world({.free_poses = 0, .fixed_poses = 4}, 10);
  EXPECT_EQ(adjust(fixed.problem).status, BundleSummary::Status::kNothingToDo);
}

TEST(BundleAdjustmentTest, RefusesIndicesOutOfRange) {
  auto world = make_bundle_world({}, 11);
  world.problem.observations[3].pose = 1000;
  EXPECT_THROW((void)adjust(world.problem), std::logic_error);
}

TEST(BundleAdjustmentTest, ReportsItselfInOneLine) {
  auto world = make_bundle_world({}, 12);
  const auto text = adjust(world.problem).to_string(0.0123);
  EXPECT_NE(text.find("converged"), std::string::npos) << text;
  EXPECT_NE(text.find("12.3 ms"), std::string::npos) << text;
  EXPECT_EQ(text.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace camvox::optimization
