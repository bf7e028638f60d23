#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/geometry/se3.hpp"

namespace camvox::loop {

/// What the map's poses are worth: how far two of them may be wrong relative to each other, as a
/// function of the length of the path between them. YAML keys are the field names.
struct DriftConfig {
  double base_sigma_m = 0.03;     ///< Between neighbours.
  double base_sigma_deg = 0.15;   ///< The same, rotation.
  double sigma_m_per_m = 0.015;   ///< More for every metre of path.
  double sigma_deg_per_m = 0.01;  ///< The same, rotation.
  double gate_sigma = 4.5;        ///< Farther off is inconsistent (99.9 % of six dimensions).

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("base_sigma_m", self.base_sigma_m, positive);
    field("base_sigma_deg", self.base_sigma_deg, positive);
    field("sigma_m_per_m", self.sigma_m_per_m, positive);
    field("sigma_deg_per_m", self.sigma_deg_per_m, positive);
    field("gate_sigma", self.gate_sigma, positive);
  }
};

/// Standard deviation of a relative pose, the same for all axes.
struct PoseSigma {
  double rotation_rad = 0.0;
  double translation_m = 0.0;

  [[nodiscard]] geometry::Matrix6d covariance() const;
};

/// Of the least certain axis.
[[nodiscard]] PoseSigma largest_sigma(const geometry::Matrix6d& covariance);

/// Of a path of this length.
[[nodiscard]] PoseSigma path_sigma(double length_m, const DriftConfig& config);

/// A loop as it was measured: the pose of a keyframe in the frame of an older one.
struct LoopMeasurement {
  std::uint64_t query_id = 0;
  std::uint64_t match_id = 0;
  geometry::SE3 T_match_query;
  geometry::Matrix6d covariance_query = geometry::Matrix6d::Identity();
  int inliers = 0;
  bool by_surfaces = false;  ///< Not by images: the two share nothing that could be fused.
};

/// Two measurements, and how the map relates their ends.
struct LoopPair {
  const LoopMeasurement* a = nullptr;
  const LoopMeasurement* b = nullptr;
  geometry::SE3 T_query_a_query_b;
  geometry::SE3 T_match_a_match_b;
  double query_path_m = 0.0;  ///< Length of the path between the queries.
  double match_path_m = 0.0;  ///< Length of the path between the matches.
};

/// Can both be right? The circle query a -> match a -> match b -> query b -> query a must close
/// within what drift and measurements allow (PCM: Mangelson, Dominic, Eustice, Vasudevan, ICRA
/// 2018).
[[nodiscard]] bool consistent(const LoopPair& pair, const DriftConfig& config);

/// Does a measured pose agree with the map's, whose path between the two is `path_m` long?
[[nodiscard]] bool plausible(const LoopMeasurement& measurement,
                             const geometry::SE3& T_match_query_in_map,
                             double path_m,
                             const DriftConfig& config);

/// The largest set of vertices that are all neighbours of one another, ascending; of several the
/// one found first, in a fixed order. Branch and bound with a greedy colouring (Tomita, Seki,
/// 2003); after `max_steps` branches the best one so far.
[[nodiscard]] std::vector<std::size_t> maximum_clique(
    const std::vector<std::vector<bool>>& adjacent, std::size_t max_steps = 200000);

}  // namespace camvox::loop
