#include "rigid_ransac.hpp"

#include <Eigen/SVD>
#include <array>
#include <cmath>
#include <random>

namespace camvox::loop {
namespace {

using geometry::SE3;

/// Two sides of a triangle must be as long in both frames.
bool is_rigid(const std::vector<PointPair>& sample) {
  for (std::size_t i = 0; i < sample.size(); ++i) {
    const auto& a = sample[i];
    const auto& b = sample[(i + 1) % sample.size()];
    const double length_place = (a.p_place - b.p_place).norm();
    const double length_query = (a.p_query - b.p_query).norm();
    if (std::abs(length_place - length_query) > a.tolerance_m + b.tolerance_m) return false;
  }
  return true;
}

/// Samples after which a better motion would have been found with probability 0.999.
double enough_samples(int inliers, std::size_t candidates) {
  const double ratio = static_cast<double>(inliers) / static_cast<double>(candidates);
  const double failure = 1.0 - std::pow(std::min(ratio, 0.999), 3.0);
  return std::log(1e-3) / std::log(std::max(failure, 1e-9));
}

}  // namespace

std::optional<SE3> align_points(const std::vector<PointPair>& pairs) {
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Vector3d mean_place = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_query = Eigen::Vector3d::Zero();
  for (const auto& pair : pairs) {
    mean_place += pair.p_place;
    mean_query += pair.p_query;
  }
  mean_place /= static_cast<double>(pairs.size());
  mean_query /= static_cast<double>(pairs.size());
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (const auto& pair : pairs) {
    moments += (pair.p_place - mean_place) * (pair.p_query - mean_query).transpose();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const auto& sizes = svd.singularValues();
  if (!(sizes[1] > 1e-6 * sizes[0])) return std::nullopt;
  Eigen::Vector3d signs(1.0, 1.0, 1.0);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) signs[2] = -1.0;
  const Eigen::Matrix3d R = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return SE3(geometry::SO3::from_matrix(R), mean_place - R * mean_query);
}

std::optional<SE3> rigid_ransac(const std::vector<PointPair>& pairs,
                                const RigidRansacRule& rule,
                                const std::function<int(const SE3&)>& count_inliers) {
  if (pairs.size() < 3) return std::nullopt;
  std::mt19937_64 random(rule.seed);
  std::optional<SE3> best;
  int best_inliers = 0;
  double needed = rule.max_iterations;
  std::vector<PointPair> sample(3);
  // A sample that is not rigid costs next to nothing, so more of them are drawn.
  const int max_draws = 10 * rule.max_iterations;
  for (int draw = 0, tried = 0; draw < max_draws && tried < needed; ++draw) {
    for (auto& pair : sample) pair = pairs[random() % pairs.size()];
    if (!is_rigid(sample)) continue;
    const auto T = align_points(sample);
    if (!T) continue;
    ++tried;
    const int inliers = count_inliers(*T);
    if (inliers <= best_inliers) continue;
    best_inliers = inliers;
    best = T;
    needed = std::min<double>(rule.max_iterations, enough_samples(inliers, rule.candidates));
  }
  return best;
}

}  // namespace camvox::loop
