#pragma once

#include <cstdint>
#include <span>

#include "camvox/features/feature.hpp"

namespace camvox::features {

inline constexpr int kDescriptorBits = 256;

/// Number of bits in which two descriptors differ.
[[nodiscard]] int hamming_distance(const Descriptor& a, const Descriptor& b);

/// The distance of `query` to each of `descriptors`, into `distances` of the same length.
void hamming_distances(const Descriptor& query,
                       std::span<const Descriptor> descriptors,
                       std::span<std::uint16_t> distances);

/// The distance of `query` to those of `descriptors` that `candidates` lists.
void hamming_distances(const Descriptor& query,
                       std::span<const Descriptor> descriptors,
                       std::span<const std::uint32_t> candidates,
                       std::span<std::uint16_t> distances);

/// The nearest of some descriptors, and the distance of the second nearest.
struct Nearest {
  int index = -1;  ///< -1: there is none.
  int distance = kDescriptorBits + 1;
  int second_distance = kDescriptorBits + 1;
};

/// The nearest of those of `descriptors` that `candidates` lists; the first listed of equals.
[[nodiscard]] Nearest nearest_descriptor(const Descriptor& query,
                                         std::span<const Descriptor> descriptors,
                                         std::span<const std::uint32_t> candidates);

/// The descriptor with the least median distance to all of them: the one that stands for a landmark
/// seen several times (Mur-Artal & Tardos, T-RO 2015). Of equals the first; -1 for an empty list.
[[nodiscard]] int median_descriptor(std::span<const Descriptor> descriptors);

}  // namespace camvox::features
