#include "feature_matching.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

#include "camvox/config/target_clones.hpp"
#include "camvox/features/hamming.hpp"
#include "camvox/loop/place_index.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;

constexpr std::uint16_t kFar = std::numeric_limits<std::uint16_t>::max();

/// The features of the match that are compared, and which of the query is nearest to each.
struct Candidates {
  std::vector<std::size_t> features;
  std::vector<Descriptor> descriptors;
  std::vector<std::uint16_t> nearest_bits;
  std::vector<std::uint16_t> nearest_query;
};

Candidates candidates_of(const features::FrameFeatures& match, std::size_t count) {
  Candidates candidates;
  for (const auto i : strongest_features(match, count)) {
    if (!(match.depth_m[i] > 0.0F)) continue;
    candidates.features.push_back(i);
    candidates.descriptors.push_back(match.descriptors[i]);
  }
  candidates.nearest_bits.assign(candidates.features.size(), kFar);
  candidates.nearest_query.assign(candidates.features.size(), 0);
  return candidates;
}

CAMVOX_TARGET_CLONES std::uint16_t smallest(const std::uint16_t* values, std::size_t count) {
  std::uint16_t result = kFar;
  for (std::size_t i = 0; i < count; ++i) result = std::min(result, values[i]);
  return result;
}

CAMVOX_TARGET_CLONES void keep_nearest(const std::uint16_t* distances,
                                       std::size_t count,
                                       std::uint16_t query,
                                       std::uint16_t* nearest_bits,
                                       std::uint16_t* nearest_query) {
  for (std::size_t i = 0; i < count; ++i) {
    const bool nearer = distances[i] < nearest_bits[i];
    nearest_query[i] = nearer ? query : nearest_query[i];
    nearest_bits[i] = nearer ? distances[i] : nearest_bits[i];
  }
}

}  // namespace

std::vector<FeatureMatch> match_all(const features::FrameFeatures& query,
                                    const features::FrameFeatures& match,
                                    const MatchingRule& rule) {
  auto candidates = candidates_of(match, rule.max_features);
  const std::size_t count = candidates.features.size();
  std::vector<std::uint16_t> distances(count);
  std::vector<FeatureMatch> one_way;
  std::vector<std::size_t> chosen;  ///< By match: the candidate.
  for (const auto i : strongest_features(query, rule.max_features)) {
    features::hamming_distances(query.descriptors[i], candidates.descriptors, distances);
    keep_nearest(distances.data(),
                 count,
                 static_cast<std::uint16_t>(i),
                 candidates.nearest_bits.data(),
                 candidates.nearest_query.data());
    const auto first_bits = smallest(distances.data(), count);
    if (first_bits > rule.max_distance_bits) continue;
    const auto nearest = std::find(distances.begin(), distances.end(), first_bits);
    *nearest = kFar;
    if (first_bits > rule.max_ratio * smallest(distances.data(), count)) continue;
    chosen.push_back(static_cast<std::size_t>(nearest - distances.begin()));
    one_way.push_back({i, candidates.features[chosen.back()], first_bits});
  }
  std::vector<FeatureMatch> matches;
  for (std::size_t k = 0; k < one_way.size(); ++k) {
    if (candidates.nearest_query[chosen[k]] == one_way[k].query) matches.push_back(one_way[k]);
  }
  return matches;
}

}  // namespace camvox::loop
