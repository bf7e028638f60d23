#pragma once

#include <optional>
#include <string>
#include <vector>

#include "camvox/trajectory/trajectory.hpp"

namespace camvox::trajectory {

/// How an estimate is laid over its reference before they are compared.
enum class Alignment {
  kNone,
  kOrigin,  ///< The first poses made equal.
  kSE3,     ///< Rigid, least squares over all positions.
  kSim3,    ///< The same with scale.
};

/// "none", "origin", "se3", "sim3".
[[nodiscard]] std::optional<Alignment> parse_alignment(const std::string& name);

/// x -> scale * R x + t.
struct Similarity {
  geometry::SE3 T_reference_estimate;
  double scale = 1.0;
};

/// The transform that lays the estimates over the references. Least squares by Umeyama (PAMI 1991),
/// Eigen's implementation. Nothing when the positions do not determine it: fewer than three pairs,
/// or all on one line (kSE3, kSim3); none at all (kOrigin).
[[nodiscard]] std::optional<Similarity> align(const std::vector<PosePair>& pairs,
                                              Alignment alignment);

/// The pairs with their estimates moved.
[[nodiscard]] std::vector<PosePair> transformed(const Similarity& similarity,
                                                std::vector<PosePair> pairs);

}  // namespace camvox::trajectory
