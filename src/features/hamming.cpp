#include "camvox/features/hamming.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

CAMVOX_ALWAYS_INLINE int distance(const Descriptor& a, const Descriptor& b) {
  std::uint64_t words_a[4];
  std::uint64_t words_b[4];
  std::memcpy(words_a, &a, sizeof words_a);
  std::memcpy(words_b, &b, sizeof words_b);
  int bits = 0;
  for (int i = 0; i < 4; ++i) bits += __builtin_popcountll(words_a[i] ^ words_b[i]);
  return bits;
}

}  // namespace

CAMVOX_TARGET_CLONES int hamming_distance(const Descriptor& a, const Descriptor& b) {
  return distance(a, b);
}

CAMVOX_TARGET_CLONES void hamming_distances(const Descriptor& query,
                                            std::span<const Descriptor> descriptors,
                                            std::span<std::uint16_t> distances) {
  if (descriptors.size() != distances.size()) throw std::logic_error("lists of different length");
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    distances[i] = static_cast<std::uint16_t>(distance(query, descriptors[i]));
  }
}

CAMVOX_TARGET_CLONES void hamming_distances(const Descriptor& query,
                                            std::span<const Descriptor> descriptors,
                                            std::span<const std::uint32_t> candidates,
                                            std::span<std::uint16_t> distances) {
  if (candidates.size() != distances.size()) throw std::logic_error("lists of different length");
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    distances[i] = static_cast<std::uint16_t>(distance(query, descriptors[candidates[i]]));
  }
}

CAMVOX_TARGET_CLONES Nearest nearest_descriptor(const Descriptor& query,
                                                std::span<const Descriptor> descriptors,
                                                std::span<const std::uint32_t> candidates) {
  Nearest nearest;
  for (const std::uint32_t candidate : candidates) {
    const int bits = distance(query, descriptors[candidate]);
    if (bits < nearest.distance) {
      nearest.second_distance = nearest.distance;
      nearest.distance = bits;
      nearest.index = static_cast<int>(candidate);
    } else if (bits < nearest.second_distance) {
      nearest.second_distance = bits;
    }
  }
  return nearest;
}

int median_descriptor(std::span<const Descriptor> descriptors) {
  int best = -1;
  int best_median = kDescriptorBits + 1;
  std::vector<std::uint16_t> distances(descriptors.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    hamming_distances(descriptors[i], descriptors, distances);
    const auto middle = distances.begin() + static_cast<std::ptrdiff_t>((distances.size() - 1) / 2);
    std::nth_element(distances.begin(), middle, distances.end());
    if (*middle < best_median) {
      best_median = *middle;
      best = static_cast<int>(i);
    }
  }
  return best;
}

}  // namespace camvox::features
