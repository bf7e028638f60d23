#pragma once

#include <cstddef>
#include <vector>

#include "camvox/features/feature.hpp"

namespace camvox::loop {

/// Groups of near descriptors.
struct Clustering {
  std::vector<features::Descriptor> centres;  ///< Bitwise majority of the members.
  std::vector<std::size_t> assignment;        ///< Of each descriptor, the index of its centre.
};

/// Divides descriptors into at most `count` groups, none empty: k-majority, begun with descriptors
/// far from one another. Descriptors that are all the same come back as one group.
[[nodiscard]] Clustering cluster(const std::vector<features::Descriptor>& descriptors,
                                 std::size_t count);

}  // namespace camvox::loop
