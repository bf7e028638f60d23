#include "camvox/tracking/depth_alignment.hpp"

#include <Eigen/Geometry>
#include <random>

namespace camvox::tracking {
namespace {

std::optional<geometry::SE3> fit(std::span<const PointPair> pairs,
                                 const std::vector<std::size_t>& chosen) {
  Eigen::Matrix3Xd p_camera(3, static_cast<Eigen::Index>(chosen.size()));
  Eigen::Matrix3Xd p_map(3, p_camera.cols());
  for (Eigen::Index i = 0; i < p_camera.cols(); ++i) {
    p_camera.col(i) = pairs[chosen[static_cast<std::size_t>(i)]].p_camera;
    p_map.col(i) = pairs[chosen[static_cast<std::size_t>(i)]].p_map;
  }
  const Eigen::Matrix4d T = Eigen::umeyama(p_camera, p_map, false);
  if (!T.allFinite()) return std::nullopt;
  return geometry::SE3(geometry::SO3::from_matrix(T.topLeftCorner<3, 3>()),
                       T.topRightCorner<3, 1>());
}

std::vector<std::size_t> inliers_of(std::span<const PointPair> pairs,
                                    const geometry::SE3& T_map_camera,
                                    const DepthAlignmentOptions& options) {
  const Eigen::Matrix3d R = T_map_camera.rotation().matrix();
  std::vector<std::size_t> inliers;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double tolerance_m =
        options.tolerance_m + options.tolerance_ratio * pairs[i].p_camera.norm();
    const Eigen::Vector3d error =
        R * pairs[i].p_camera + T_map_camera.translation() - pairs[i].p_map;
    if (error.squaredNorm() < tolerance_m * tolerance_m) inliers.push_back(i);
  }
  return inliers;
}

/// Whether three points span the distances between them alike, so that a pose can exist.
bool is_plausible(std::span<const PointPair> pairs,
                  const std::vector<std::size_t>& triple,
                  const DepthAlignmentOptions& options) {
  for (std::size_t k = 0; k < 3; ++k) {
    const auto& a = pairs[triple[k]];
    const auto& b = pairs[triple[(k + 1) % 3]];
    const double in_camera = (a.p_camera - b.p_camera).norm();
    const double in_map = (a.p_map - b.p_map).norm();
    const double tolerance_m = 2.0 * options.tolerance_m +
                               options.tolerance_ratio * (a.p_camera.norm() + b.p_camera.norm());
    if (in_camera < 2.0 * tolerance_m || std::abs(in_camera - in_map) > tolerance_m) return false;
  }
  return true;
}

}  // namespace

std::optional<DepthAlignment> align_by_depth(std::span<const PointPair> pairs,
                                             const DepthAlignmentOptions& options) {
  if (pairs.size() < 3 || static_cast<int>(pairs.size()) < options.min_inliers) return std::nullopt;
  std::mt19937_64 random(options.seed);
  std::vector<std::size_t> best;
  std::vector<std::size_t> triple(3);
  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    for (auto& index : triple) index = static_cast<std::size_t>(random() % pairs.size());
    if (!is_plausible(pairs, triple, options)) continue;
    const auto T_map_camera = fit(pairs, triple);
    if (!T_map_camera) continue;
    auto inliers = inliers_of(pairs, *T_map_camera, options);
    if (inliers.size() > best.size()) best = std::move(inliers);
  }
  DepthAlignment alignment;
  for (int refinement = 0; refinement < 3; ++refinement) {
    if (static_cast<int>(best.size()) < options.min_inliers) return std::nullopt;
    const auto T_map_camera = fit(pairs, best);
    if (!T_map_camera) return std::nullopt;
    alignment.T_map_camera = *T_map_camera;
    best = inliers_of(pairs, alignment.T_map_camera, options);
  }
  alignment.inlier_count = static_cast<int>(best.size());
  if (alignment.inlier_count < options.min_inliers) return std::nullopt;
  alignment.inliers.assign(pairs.size(), false);
  for (const std::size_t i : best) alignment.inliers[i] = true;
  return alignment;
}

}  // namespace camvox::tracking
