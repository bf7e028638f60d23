#include "majority_clustering.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include "camvox/features/hamming.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;

constexpr int kRounds = 4;

/// Begins with the first descriptor, then takes the one farthest from all taken so far.
std::vector<Descriptor> spread_seeds(const std::vector<Descriptor>& descriptors,
                                     std::size_t count) {
  const std::size_t size = descriptors.size();
  std::vector<std::uint16_t> nearest(size, std::numeric_limits<std::uint16_t>::max());
  std::vector<std::uint16_t> distances(size);
  std::vector<Descriptor> seeds = {descriptors.front()};
  while (seeds.size() < count) {
    features::hamming_distances(seeds.back(), descriptors, distances);
    for (std::size_t i = 0; i < size; ++i) nearest[i] = std::min(nearest[i], distances[i]);
    const auto farthest = std::max_element(nearest.begin(), nearest.end());
    if (*farthest == 0) break;
    seeds.push_back(descriptors[static_cast<std::size_t>(farthest - nearest.begin())]);
  }
  return seeds;
}

void assign(const std::vector<Descriptor>& descriptors, Clustering& clustering) {
  std::vector<std::uint16_t> distances(clustering.centres.size());
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    features::hamming_distances(descriptors[i], clustering.centres, distances);
    clustering.assignment[i] = static_cast<std::size_t>(
        std::min_element(distances.begin(), distances.end()) - distances.begin());
  }
}

Descriptor majority(const std::vector<Descriptor>& descriptors,
                    const std::vector<std::size_t>& assignment,
                    std::size_t group) {
  std::array<int, 256> ones{};
  int members = 0;
  for (std::size_t i = 0; i < descriptors.size(); ++i) {
    if (assignment[i] != group) continue;
    ++members;
    for (std::size_t bit = 0; bit < 256; ++bit) {
      ones[bit] += (descriptors[i].bytes[bit / 8] >> (bit % 8)) & 1;
    }
  }
  Descriptor centre;
  for (std::size_t bit = 0; bit < 256; ++bit) {
    if (2 * ones[bit] <= members) continue;
    auto& byte = centre.bytes[bit / 8];
    byte = static_cast<std::uint8_t>(byte | (1U << (bit % 8)));
  }
  return centre;
}

/// Takes out groups without members.
void compact(Clustering& clustering) {
  std::vector<std::size_t> members(clustering.centres.size(), 0);
  for (const auto group : clustering.assignment) ++members[group];
  std::vector<std::size_t> renamed(members.size(), 0);
  std::vector<Descriptor> kept;
  for (std::size_t group = 0; group < members.size(); ++group) {
    renamed[group] = kept.size();
    if (members[group] > 0) kept.push_back(clustering.centres[group]);
  }
  clustering.centres = std::move(kept);
  for (auto& group : clustering.assignment) group = renamed[group];
}

}  // namespace

Clustering cluster(const std::vector<Descriptor>& descriptors, std::size_t count) {
  Clustering clustering;
  if (descriptors.empty()) return clustering;
  clustering.centres = spread_seeds(descriptors, std::max<std::size_t>(count, 1));
  clustering.assignment.resize(descriptors.size());
  for (int round = 0; round < kRounds; ++round) {
    assign(descriptors, clustering);
    compact(clustering);
    for (std::size_t group = 0; group < clustering.centres.size(); ++group) {
      clustering.centres[group] = majority(descriptors, clustering.assignment, group);
    }
  }
  assign(descriptors, clustering);
  compact(clustering);
  return clustering;
}

}  // namespace camvox::loop
