#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"

namespace camvox::optimization {

/// A camera pose to be refined, or one that holds the others in place.
struct BundlePose {
  geometry::SE3 T_world_camera;
  bool fixed = false;
};

/// One point seen from one pose. The outlier flags are in- and output: what is flagged is left out.
struct BundleObservation {
  std::uint32_t pose = 0;   ///< Index in BundleProblem::poses.
  std::uint32_t point = 0;  ///< Index in BundleProblem::points_world.
  PointObservation observation;
  bool outlier = false;        ///< The pixel disagrees: not an image of this point.
  bool depth_outlier = false;  ///< Only the depth disagrees, as at the edge of an object.
};

/// Poses, points and what was seen of them.
struct BundleProblem {
  std::vector<BundlePose> poses;
  std::vector<Eigen::Vector3d> points_world;
  std::vector<BundleObservation> observations;
  PinholeCamera camera;
  DepthModel depth_model = DepthModel::kMetric;
};

/// Tuning of adjust().
struct BundleAdjustmentConfig {
  int first_iterations = 5;    ///< Before outliers are taken out.
  int second_iterations = 10;  ///< After that.
  double pixel_gate = 5.991;   ///< Squared error, sigma^2, above which a pixel is an outlier.
  double depth_gate = 3.841;   ///< The same for a depth.
  double relative_cost_change = 1e-4;  ///< Ends a round when an iteration gains less.
  int max_dense_poses = 100;           ///< More free poses than these are solved sparsely.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("first_iterations", self.first_iterations, config::at_least(1));
    field("second_iterations", self.second_iterations, config::at_least(0));
    field("pixel_gate", self.pixel_gate, config::greater_than(0.0));
    field("depth_gate", self.depth_gate, config::greater_than(0.0));
    field("relative_cost_change", self.relative_cost_change, config::at_least(0.0));
    field("max_dense_poses", self.max_dense_poses, config::at_least(0));
  }
};

/// What adjust() did.
struct BundleSummary {
  enum class Status {
    kConverged,    ///< Or out of iterations, which is as good.
    kInterrupted,  ///< Stopped from outside; the poses and points are the best so far.
    kNothingToDo,  ///< No free pose or no observation.
  };
  Status status = Status::kNothingToDo;
  int iterations = 0;
  std::size_t free_poses = 0;
  std::size_t fixed_poses = 0;
  std::size_t points = 0;
  std::size_t observations = 0;
  std::size_t outliers = 0;        ///< Observations flagged in the end.
  std::size_t depth_outliers = 0;  ///< Depths flagged in the end, their pixels being good.
  double cost_before = 0.0;  ///< Half the robustified squared error of what is no outlier after.
  double cost_after = 0.0;   ///< The same over the same observations.

  /// One line: cost before and after, iterations, sizes, and the time that the caller measured.
  [[nodiscard]] std::string to_string(double time_s) const;
};

/// Moves free poses and all points to where they agree best with the observations: robust (Huber)
/// least squares by Levenberg-Marquardt on the Schur complement (Triggs et al., "Bundle adjustment:
/// a modern synthesis", 2000, section 6.1), pixels and depths with kernels of their own, so that a
/// wrong depth costs only the depth. Two rounds; in between, and at the end, every observation that
/// came in unflagged is judged against the gates. Fix at least one pose. `stop` may end it after
/// any iteration; in the first round, it ends without having judged. Same input, same bytes. Throws
/// std::logic_error when an index is out of range.
[[nodiscard]] BundleSummary adjust(BundleProblem& problem,
                                   const BundleAdjustmentConfig& config = {},
                                   const std::atomic<bool>* stop = nullptr);

}  // namespace camvox::optimization
