#include "camvox/trajectory/alignment.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace camvox::trajectory {
namespace {

/// Below this ratio of the spread across a path to that along it, errors of the estimate tell more
/// about the rotation around the path than its bends do.
constexpr double kLineRatio = 0.02;

/// Principal directions of points, and how far they spread along each (root mean square).
struct Spread {
  explicit Spread(const Eigen::Matrix3Xd& points) : centre(points.rowwise().mean()) {
    const Eigen::Matrix3Xd centred = points.colwise() - centre;
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(centred * centred.transpose(), Eigen::ComputeFullU);
    direction = svd.matrixU().col(0);
    along_m2 = svd.singularValues()[0];
    across_m2 = svd.singularValues()[1];
  }
  [[nodiscard]] bool is_plane() const { return across_m2 > 1e-12 * along_m2 && along_m2 > 0.0; }
  [[nodiscard]] bool is_line() const { return across_m2 < kLineRatio * kLineRatio * along_m2; }

  Eigen::Vector3d centre;
  Eigen::Vector3d direction;
  double along_m2 = 0.0;
  double across_m2 = 0.0;
};

/// GNSS fixes come without: all identity.
bool have_orientations(const std::vector<PosePair>& pairs) {
  const auto turned = [](const StampedPose& pose) {
    return !pose.T_world_body.rotation().matrix().isIdentity(0.0);
  };
  return std::any_of(
             pairs.begin(), pairs.end(), [&](const auto& p) { return turned(p.reference); }) &&
         std::any_of(pairs.begin(), pairs.end(), [&](const auto& p) { return turned(p.estimate); });
}

/// The turn phi about the unit vector u that makes the orientations agree best: it maximises
/// sum tr(R_reference^T exp(phi u) R R_estimate) = tr(exp(phi u) M), by Rodrigues' formula
/// const + cos(phi) (tr M - u^T M u) + sin(phi) tr([u]x M).
geometry::SO3 best_turn_about(const Eigen::Vector3d& u,
                              const geometry::SO3& R,
                              const std::vector<PosePair>& pairs) {
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (const auto& pair : pairs) {
    M += (R * pair.estimate.T_world_body.rotation() *
          pair.reference.T_world_body.rotation().inverse())
             .matrix();
  }
  const double phi_rad = std::atan2((geometry::skew(u) * M).trace(), M.trace() - u.dot(M * u));
  return geometry::SO3::exp(phi_rad * u);
}

std::optional<Similarity> umeyama(const std::vector<PosePair>& pairs, bool with_scale) {
  if (pairs.size() < 3) return std::nullopt;
  Eigen::Matrix3Xd estimate(3, pairs.size());
  Eigen::Matrix3Xd reference(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    estimate.col(column) = pairs[i].estimate.T_world_body.translation();
    reference.col(column) = pairs[i].reference.T_world_body.translation();
  }
  const Spread of_estimate(estimate);
  const Spread of_reference(reference);
  if (!(of_estimate.along_m2 > 0.0) || !(of_reference.along_m2 > 0.0)) return std::nullopt;
  Similarity result;
  result.on_a_line = of_reference.is_line() && have_orientations(pairs);
  if (!result.on_a_line && (!of_estimate.is_plane() || !of_reference.is_plane()))
    return std::nullopt;
  const Eigen::Matrix4d matrix = Eigen::umeyama(estimate, reference, with_scale);
  const Eigen::Matrix3d scaled = matrix.topLeftCorner<3, 3>();
  result.scale = std::cbrt(scaled.determinant());
  auto rotation = geometry::SO3::from_matrix(scaled / result.scale);
  if (result.on_a_line)
    rotation = best_turn_about(of_reference.direction, rotation, pairs) * rotation;
  result.T_reference_estimate = {
      rotation, of_reference.centre - result.scale * (rotation * of_estimate.centre)};
  return result;
}

}  // namespace

std::optional<Alignment> parse_alignment(const std::string& name) {
  if (name == "none") return Alignment::kNone;
  if (name == "origin") return Alignment::kOrigin;
  if (name == "se3") return Alignment::kSE3;
  if (name == "sim3") return Alignment::kSim3;
  return std::nullopt;
}

std::optional<Similarity> align(const std::vector<PosePair>& pairs, Alignment alignment) {
  if (alignment == Alignment::kNone) return Similarity{};
  if (alignment != Alignment::kOrigin) return umeyama(pairs, alignment == Alignment::kSim3);
  if (pairs.empty()) return std::nullopt;
  const auto& first = pairs.front();
  return Similarity{first.reference.T_world_body * first.estimate.T_world_body.inverse(), 1.0};
}

std::vector<PosePair> transformed(const Similarity& similarity, std::vector<PosePair> pairs) {
  for (auto& pair : pairs) {
    auto& T = pair.estimate.T_world_body;
    T = similarity.T_reference_estimate *
        geometry::SE3(T.rotation(), similarity.scale * T.translation());
  }
  return pairs;
}

}  // namespace camvox::trajectory
