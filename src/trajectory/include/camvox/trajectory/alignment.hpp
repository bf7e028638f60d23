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
  bool on_a_line = false;  ///< The rotation about the path comes from the orientations.
};

/// The transform that lays the estimates over the references. Least squares by Umeyama (PAMI 1991),
/// Eigen's implementation. Positions (nearly) on one line leave the rotation about it open: it is
/// then the one that makes the orientations agree best. Nothing when that is not determined either:
/// fewer than three pairs, or a line and no orientations (kSE3, kSim3); no pair at all (kOrigin).
[[nodiscard]] std::optional<Similarity> align(const std::vector<PosePair>& pairs,
                                              Alignment alignment);

/// The pairs with their estimates moved.
[[nodiscard]] std::vector<PosePair> transformed(const Similarity& similarity,
                                                std::vector<PosePair> pairs);

}  // namespace camvox::trajectory
