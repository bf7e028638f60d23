#pragma once

#include <cstddef>
#include <vector>

#include "camvox/features/feature.hpp"

namespace camvox::loop {

/// Features of two images that look alike.
struct FeatureMatch {
  std::size_t query = 0;
  std::size_t match = 0;
  int distance_bits = 0;
};

struct MatchingRule {
  int max_distance_bits = 64;
  double max_ratio = 0.85;          ///< Of the nearest to the second nearest distance.
  std::size_t max_features = 1000;  ///< Strongest ones of each image that are compared.
};

/// Matches the query's descriptors with those features of `match` that have depth, all with all:
/// each must be the other's nearest, and clearly nearer than the next. In the query's order. At
/// most 65536 features.
[[nodiscard]] std::vector<FeatureMatch> match_all(const features::FrameFeatures& query,
                                                  const features::FrameFeatures& match,
                                                  const MatchingRule& rule);

}  // namespace camvox::loop
