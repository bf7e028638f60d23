#pragma once

#include <Eigen/Core>
#include <Eigen/StdVector>
#include <cstdint>
#include <vector>

#include "camvox/optimization/bundle_adjustment.hpp"

namespace camvox::optimization::internal {

/// One round of bundle adjustment over the observations that are not flagged.
///
/// Written out instead of given to Ceres: with 15 free poses, 2 500 points and 18 000 observations
/// Ceres (DENSE_SCHUR specialised to 2,3,6, analytic Jacobians, one thread) takes 90 ms for one
/// round of 4 iterations, this 35 ms for both rounds, 6 iterations. A test holds the optimum
/// against Ceres.
class BundleSolver {
 public:
  BundleSolver(BundleProblem& problem, const BundleAdjustmentConfig& config);

  /// Improves the problem's poses and points; returns how many iterations that took.
  int run(int max_iterations, const std::atomic<bool>* stop);

 private:
  using Vector6d = geometry::Vector6d;
  using Matrix6d = geometry::Matrix6d;
  using Matrix63d = Eigen::Matrix<double, 6, 3>;

  /// An observation in use, and the block that ties its pose to its point.
  struct Link {
    std::uint32_t observation = 0;
    std::int32_t free_pose = -1;  ///< -1: the pose is fixed.
    std::uint32_t point = 0;      ///< Index in points_.
    Matrix63d H_pose_point = Matrix63d::Zero();
  };
  /// A point in use: links [begin, end) are its observations.
  struct Point {
    std::uint32_t index = 0;
    std::uint32_t begin = 0;
    std::uint32_t end = 0;
    Eigen::Matrix3d H = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();  ///< Negative gradient.
    Eigen::Matrix3d H_inverse = Eigen::Matrix3d::Zero();
  };
  /// A block on or above the diagonal of the reduced system.
  struct Block {
    std::uint32_t row = 0;
    std::uint32_t column = 0;
    Matrix6d S = Matrix6d::Zero();
  };

  void number_free_poses();
  void group_by_point();
  void group_by_pose();
  void find_blocks();

  /// Half the robustified squared error; infinite when a point is behind a camera that sees it.
  [[nodiscard]] double cost() const;
  void linearize();
  void reduce(double lambda);
  void reduce_row(std::uint32_t row, double lambda);
  [[nodiscard]] bool solve_poses();
  [[nodiscard]] bool solve_dense(Eigen::VectorXd& step) const;
  [[nodiscard]] bool solve_sparse(Eigen::VectorXd& step) const;
  void solve_points();
  [[nodiscard]] double predicted_decrease(double lambda) const;
  void apply_step();
  void undo_step();

  BundleProblem& problem_;
  const BundleAdjustmentConfig& config_;
  std::vector<std::int32_t> free_index_;  ///< By pose; -1: fixed.
  std::vector<std::uint32_t> free_poses_;
  std::vector<Link> links_;
  std::vector<Point> points_;
  std::vector<std::uint32_t> pose_begin_;  ///< Links of free pose f: pose_links_[f..f + 1).
  std::vector<std::uint32_t> pose_links_;  ///< Indices into links_, ascending for each pose.
  std::vector<Block> blocks_;              ///< By row, then by column.
  std::vector<std::uint32_t> row_begin_;   ///< Blocks of row f: [f..f + 1), the diagonal first.
  std::vector<std::uint32_t> block_of_;    ///< By column, for one row at a time.
  std::vector<Matrix6d> H_poses_;
  std::vector<Vector6d> g_poses_;
  Eigen::VectorXd g_reduced_;
  Eigen::VectorXd step_poses_;
  std::vector<Eigen::Vector3d> step_points_;
  std::vector<geometry::SE3> old_poses_;
  std::vector<Eigen::Vector3d> old_points_;
};

/// The factor of the Huber kernel on a squared error: rho'(e2), and the kernel's value.
struct Huber {
  double weight = 1.0;
  double value = 0.0;
};
[[nodiscard]] Huber huber(double squared_error, double squared_threshold);

}  // namespace camvox::optimization::internal
