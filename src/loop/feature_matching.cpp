#include "feature_matching.hpp"

#include <cstdint>
#include <limits>

#include "camvox/features/hamming.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

struct Nearest {
  std::size_t index = kNone;
  int first_bits = 257;
  int second_bits = 257;

  void see(std::size_t candidate, int bits) {
    if (bits < first_bits) {
      second_bits = first_bits;
      first_bits = bits;
      index = candidate;
    } else if (bits < second_bits) {
      second_bits = bits;
    }
  }
};

}  // namespace

std::vector<FeatureMatch> match_all(const features::FrameFeatures& query,
                                    const features::FrameFeatures& match,
                                    const MatchingRule& rule) {
  std::vector<std::size_t> with_depth;
  std::vector<Descriptor> descriptors;
  for (std::size_t i = 0; i < match.size(); ++i) {
    if (!(match.depth_m[i] > 0.0F)) continue;
    with_depth.push_back(i);
    descriptors.push_back(match.descriptors[i]);
  }
  std::vector<Nearest> of_query(query.size());
  std::vector<Nearest> of_match(with_depth.size());
  std::vector<std::uint16_t> distances(with_depth.size());
  for (std::size_t i = 0; i < query.size(); ++i) {
    features::hamming_distances(query.descriptors[i], descriptors, distances);
    for (std::size_t j = 0; j < distances.size(); ++j) {
      of_query[i].see(j, distances[j]);
      of_match[j].see(i, distances[j]);
    }
  }
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < query.size(); ++i) {
    const auto& nearest = of_query[i];
    if (nearest.index == kNone || nearest.first_bits > rule.max_distance_bits) continue;
    if (of_match[nearest.index].index != i) continue;
    if (nearest.first_bits > rule.max_ratio * nearest.second_bits) continue;
    matches.push_back({i, with_depth[nearest.index], nearest.first_bits});
  }
  return matches;
}

}  // namespace camvox::loop
