#include "camvox/optimization/pose_optimizer.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace camvox::optimization {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr double kMinDepth_m = 0.01;
constexpr double kConvergedCostRatio = 1e-5;  ///< A smaller relative gain ends a round.
constexpr double kMaxDampingGrowth = 1e8;
constexpr double kMinConditioning = 1e-12;  ///< Smallest over largest eigenvalue.

/// A match in the form that the inner loop wants: weights are inverse variances.
struct Row {
  Eigen::Vector3d p_world;
  double u_px, v_px, third;  ///< third: depth in metres, or the column in the right camera.
  double weight_u, weight_v, weight_third;  ///< weight_third 0: two rows.
};

/// Squared residuals of a row, in units of sigma.
struct Chi2 {
  double pixel = 0.0;
  double third = 0.0;
};

/// Sums over all matches at one pose.
struct Normal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0.0;
  int rows = 0;
};

class PoseProblem {
 public:
  PoseProblem(const SE3& T_start,
              std::span<const LandmarkMatch> matches,
              const PinholeCamera& camera,
              const PoseOptimizerOptions& options,
              const std::optional<PosePrior>& prior)
      : camera_(camera), options_(options), prior_(prior) {
    const bool metric = options.depth_model == DepthModel::kMetric;
    bf_ = camera.fx_px * camera.virtual_baseline_m;
    stereo_ = !metric;
    rows_.reserve(matches.size());
    const Eigen::Matrix3d R_camera_world = T_start.rotation().matrix().transpose();
    for (const auto& match : matches) {
      rows_.push_back(make_row(match, R_camera_world, T_start.translation()));
    }
    uses.resize(matches.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      uses[i] = rows_[i].weight_third > 0.0 ? MatchUse::kPixelAndDepth : MatchUse::kPixel;
    }
  }

  [[nodiscard]] Normal build(const SE3& T_world_camera, bool robust) const;
  void classify(const SE3& T_world_camera);

  std::vector<MatchUse> uses;

 private:
  [[nodiscard]] Row make_row(const LandmarkMatch& match,
                             const Eigen::Matrix3d& R_camera_world,
                             const Eigen::Vector3d& p_world_camera) const;
  [[nodiscard]] Chi2 chi2(const Row& row, const Eigen::Vector3d& p_camera) const;
  void add_prior(const SE3& T_world_camera, Normal& normal) const;

  const PinholeCamera& camera_;
  const PoseOptimizerOptions& options_;
  const std::optional<PosePrior>& prior_;
  double bf_ = 0.0;
  bool stereo_ = false;
  std::vector<Row> rows_;
};

// The landmark's uncertainty, projected at the start pose, adds to the variance of each row.
Row PoseProblem::make_row(const LandmarkMatch& match,
                          const Eigen::Matrix3d& R_camera_world,
                          const Eigen::Vector3d& p_world_camera) const {
  const auto& seen = match.observation;
  const Eigen::Vector3d p_camera = R_camera_world * (match.p_world - p_world_camera);
  const Eigen::Vector3d sigma_camera = R_camera_world * match.sigma_world;
  const double inverse_z = 1.0 / std::max(p_camera.z(), kMinDepth_m);
  const double du_px =
      camera_.fx_px * inverse_z * (sigma_camera.x() - p_camera.x() * inverse_z * sigma_camera.z());
  const double dv_px =
      camera_.fy_px * inverse_z * (sigma_camera.y() - p_camera.y() * inverse_z * sigma_camera.z());
  const double variance_px2 = seen.sigma_px * seen.sigma_px;

  Row row{match.p_world, seen.u_px.x(), seen.u_px.y(), 0.0, 0.0, 0.0, 0.0};
  row.weight_u = 1.0 / (variance_px2 + du_px * du_px);
  row.weight_v = 1.0 / (variance_px2 + dv_px * dv_px);
  if (seen.depth_m <= 0.0) return row;
  if (stereo_) {
    row.third = seen.u_px.x() - bf_ / seen.depth_m;
    row.weight_third = row.weight_u;
  } else {
    row.third = seen.depth_m;
    row.weight_third =
        1.0 / (seen.sigma_depth_m * seen.sigma_depth_m + sigma_camera.z() * sigma_camera.z());
  }
  return row;
}

Chi2 PoseProblem::chi2(const Row& row, const Eigen::Vector3d& p_camera) const {
  const double inverse_z = 1.0 / p_camera.z();
  const double u_px = camera_.fx_px * p_camera.x() * inverse_z + camera_.cx_px;
  const double du_px = u_px - row.u_px;
  const double dv_px = camera_.fy_px * p_camera.y() * inverse_z + camera_.cy_px - row.v_px;
  const double dthird = (stereo_ ? u_px - bf_ * inverse_z : p_camera.z()) - row.third;
  return {row.weight_u * du_px * du_px + row.weight_v * dv_px * dv_px,
          row.weight_third * dthird * dthird};
}

// Per match, A = J_camera^T W J_camera and a = J_camera^T W r; then the chain rule with
// d p_camera / d xi = [skew(p_camera), -I] once.
Normal PoseProblem::build(const SE3& T_world_camera, bool robust) const {
  const Eigen::Matrix3d R_camera_world = T_world_camera.rotation().matrix().transpose();
  const Eigen::Vector3d p_world_camera = T_world_camera.translation();
  Eigen::Matrix3d H_rr = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d H_rt = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d H_tt = Eigen::Matrix3d::Zero();
  Eigen::Vector3d g_r = Eigen::Vector3d::Zero();
  Eigen::Vector3d g_t = Eigen::Vector3d::Zero();
  Normal normal;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (uses[i] == MatchUse::kOutlier) continue;
    const Row& row = rows_[i];
    const Eigen::Vector3d p = R_camera_world * (row.p_world - p_world_camera);
    if (!(p.z() > kMinDepth_m)) continue;
    const bool depth = uses[i] == MatchUse::kPixelAndDepth;
    const double inverse_z = 1.0 / p.z();
    const double x = p.x() * inverse_z;
    const double y = p.y() * inverse_z;
    const double u_px = camera_.fx_px * x + camera_.cx_px;
    const double r_u = u_px - row.u_px;
    const double r_v = camera_.fy_px * y + camera_.cy_px - row.v_px;
    const double r_z = depth ? (stereo_ ? u_px - bf_ * inverse_z : p.z()) - row.third : 0.0;
    const double weight_z = depth ? row.weight_third : 0.0;
    const double squared =
        row.weight_u * r_u * r_u + row.weight_v * r_v * r_v + weight_z * r_z * r_z;
    const double gate = depth ? options_.gate_depth : options_.gate_pixel;
    double kernel = 1.0;
    if (robust && squared > gate) {
      kernel = std::sqrt(gate / squared);
      normal.cost += 2.0 * std::sqrt(gate * squared) - gate;
    } else {
      normal.cost += squared;
    }
    normal.rows += depth ? 3 : 2;

    const double a = camera_.fx_px * inverse_z;  // row u of J_camera: a, 0, -a x
    const double c = camera_.fy_px * inverse_z;  // row v of J_camera: 0, c, -c y
    const double w_u = kernel * row.weight_u;
    const double w_v = kernel * row.weight_v;
    const double w_z = kernel * weight_z;
    const double e_x = stereo_ ? a : 0.0;  // third row: e_x, 0, e_z
    const double e_z = stereo_ ? -a * x + bf_ * inverse_z * inverse_z : 1.0;
    Eigen::Matrix3d A;
    A(0, 0) = w_u * a * a + w_z * e_x * e_x;
    A(0, 1) = A(1, 0) = 0.0;
    A(0, 2) = A(2, 0) = -w_u * a * a * x + w_z * e_x * e_z;
    A(1, 1) = w_v * c * c;
    A(1, 2) = A(2, 1) = -w_v * c * c * y;
    A(2, 2) = w_u * a * a * x * x + w_v * c * c * y * y + w_z * e_z * e_z;
    const Eigen::Vector3d force(w_u * a * r_u + w_z * e_x * r_z,
                                w_v * c * r_v,
                                -w_u * a * x * r_u - w_v * c * y * r_v + w_z * e_z * r_z);
    const Eigen::Matrix3d S = geometry::skew(p);
    const Eigen::Matrix3d S_A = S * A;
    H_tt += A;
    H_rt += S_A;
    H_rr -= S_A * S;
    g_t -= force;
    g_r -= p.cross(force);
  }
  normal.H << H_rr, H_rt, H_rt.transpose(), H_tt;
  normal.g << g_r, g_t;
  add_prior(T_world_camera, normal);
  return normal;
}

void PoseProblem::add_prior(const SE3& T_world_camera, Normal& normal) const {
  if (!prior_) return;
  const Vector6d r = geometry::local(prior_->T_world_camera, T_world_camera);
  const Matrix6d J = SE3::right_jacobian_inverse(r);
  const Matrix6d J_t_W = J.transpose() * prior_->information;
  normal.H += J_t_W * J;
  normal.g += J_t_W * r;
  normal.cost += r.dot(prior_->information * r);
}

void PoseProblem::classify(const SE3& T_world_camera) {
  const Eigen::Matrix3d R_camera_world = T_world_camera.rotation().matrix().transpose();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Row& row = rows_[i];
    const Eigen::Vector3d p_camera = R_camera_world * (row.p_world - T_world_camera.translation());
    uses[i] = MatchUse::kOutlier;
    if (!(p_camera.z() > kMinDepth_m)) continue;
    const Chi2 value = chi2(row, p_camera);
    const bool has_depth = row.weight_third > 0.0;
    if (has_depth && value.pixel + value.third <= options_.gate_depth) {
      uses[i] = MatchUse::kPixelAndDepth;
    } else if ((!has_depth || !stereo_) && value.pixel <= options_.gate_pixel) {
      uses[i] = MatchUse::kPixel;
    }
  }
}

/// Levenberg-Marquardt from `T` on; returns the number of iterations.
int descend(const PoseProblem& problem, bool robust, int max_iterations, SE3& T) {
  Normal normal = problem.build(T, robust);
  double damping = 1e-6;
  int iteration = 0;
  while (iteration < max_iterations && damping < kMaxDampingGrowth) {
    ++iteration;
    Matrix6d damped = normal.H;
    damped.diagonal() *= 1.0 + damping;
    const Vector6d step = damped.ldlt().solve(-normal.g);
    if (!step.allFinite()) break;
    const SE3 T_next = geometry::retract(T, step);
    const Normal next = problem.build(T_next, robust);
    // A point that slips behind the camera would lower the cost by leaving the sum.
    if (next.cost > normal.cost || next.rows < normal.rows) {
      damping *= 10.0;
      continue;
    }
    const bool converged = normal.cost - next.cost <= kConvergedCostRatio * normal.cost;
    T = T_next;
    normal = next;
    damping = std::max(damping * 0.1, 1e-9);
    if (converged) break;
  }
  return iteration;
}

void count(PoseEstimate& estimate) {
  estimate.inliers = 0;
  estimate.inliers_with_depth = 0;
  for (const auto use : estimate.uses) {
    estimate.inliers += use != MatchUse::kOutlier ? 1 : 0;
    estimate.inliers_with_depth += use == MatchUse::kPixelAndDepth ? 1 : 0;
  }
}

/// Fills covariance and chi^2; false when the pose is not determined.
bool add_covariance(const Normal& normal, PoseEstimate& estimate) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(normal.H);
  const auto& values = eigen.eigenvalues();
  if (!(values[0] > kMinConditioning * values[5])) return false;
  estimate.chi2_per_row = normal.cost / std::max(1, normal.rows);
  estimate.covariance_camera = std::max(1.0, estimate.chi2_per_row) * eigen.eigenvectors() *
                               values.cwiseInverse().asDiagonal() *
                               eigen.eigenvectors().transpose();
  return true;
}

}  // namespace

PoseEstimate optimize_pose(const SE3& T_world_camera_start,
                           std::span<const LandmarkMatch> matches,
                           const PinholeCamera& camera,
                           const PoseOptimizerOptions& options,
                           const std::optional<PosePrior>& prior) {
  PoseEstimate estimate;
  estimate.T_world_camera = T_world_camera_start;
  estimate.uses.assign(matches.size(), MatchUse::kOutlier);
  if (static_cast<int>(matches.size()) < options.min_inliers) return estimate;

  PoseProblem problem(T_world_camera_start, matches, camera, options, prior);
  SE3 T = T_world_camera_start;
  for (int round = 0; round < options.rounds; ++round) {
    const bool robust = round + 1 < options.rounds;
    estimate.iterations += descend(problem, robust, options.iterations, T);
    problem.classify(T);
    estimate.uses = problem.uses;
    count(estimate);
    if (estimate.inliers < options.min_inliers) return estimate;
  }
  if (!add_covariance(problem.build(T, false), estimate)) {
    estimate.status = PoseEstimate::Status::kDegenerate;
    return estimate;
  }
  estimate.status = PoseEstimate::Status::kOk;
  estimate.T_world_camera = T;
  return estimate;
}

}  // namespace camvox::optimization
