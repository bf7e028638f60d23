#include "camvox/trajectory/alignment.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>

namespace camvox::trajectory {
namespace {

/// Whether points spread in at least two directions, so that a rotation can be told.
bool is_determined(const Eigen::Matrix3Xd& points) {
  if (points.cols() < 3) return false;
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::Vector3d spread =
      Eigen::JacobiSVD<Eigen::Matrix3d>(centred * centred.transpose()).singularValues();
  return spread[1] > 1e-12 * spread[0] && spread[0] > 0.0;
}

std::optional<Similarity> umeyama(const std::vector<PosePair>& pairs, bool with_scale) {
  Eigen::Matrix3Xd estimate(3, pairs.size());
  Eigen::Matrix3Xd reference(3, pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto column = static_cast<Eigen::Index>(i);
    estimate.col(column) = pairs[i].estimate.T_world_body.translation();
    reference.col(column) = pairs[i].reference.T_world_body.translation();
  }
  if (!is_determined(estimate) || !is_determined(reference)) return std::nullopt;
  const Eigen::Matrix4d matrix = Eigen::umeyama(estimate, reference, with_scale);
  Similarity result;
  const Eigen::Matrix3d scaled = matrix.topLeftCorner<3, 3>();
  result.scale = std::cbrt(scaled.determinant());
  result.T_reference_estimate = {geometry::SO3::from_matrix(scaled / result.scale),
                                 matrix.topRightCorner<3, 1>()};
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
