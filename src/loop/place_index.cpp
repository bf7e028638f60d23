#include "camvox/loop/place_index.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>

#include "camvox/features/hamming.hpp"
#include "majority_clustering.hpp"

namespace camvox::loop {
namespace {

using features::Descriptor;

/// A leaf whose descriptors cannot be told apart grows to this many times the capacity; then the
/// oldest go. They are everywhere in the map and say little about where one is.
constexpr std::size_t kMaxGrowth = 8;

}  // namespace

/// What the descriptors of one query have found so far.
struct PlaceIndex::Votes {
  explicit Votes(std::size_t slots) : scores(slots, 0.0), matches(slots, 0), seen(slots, 0) {}

  std::vector<double> scores;
  std::vector<int> matches;
  std::vector<std::uint32_t> seen;  ///< By slot: the last descriptor that voted for it.
  std::uint32_t descriptor = 0;     ///< Counts from 1.
  std::vector<Slot> hits;           ///< Of the descriptor under way.
  std::vector<std::uint16_t> distances;
};

PlaceIndex::PlaceIndex(const PlaceIndexConfig& config) : config_(config), nodes_(1), leaves_(1) {
  config::require_valid(config);
  leaves_[0].capacity = static_cast<std::size_t>(config.leaf_capacity);
}

void PlaceIndex::insert(std::uint64_t keyframe_id, const features::FrameFeatures& features) {
  const auto slot = static_cast<Slot>(ids_.size());
  if (!slots_.emplace(keyframe_id, slot).second) {
    throw std::logic_error("place index: keyframe " + std::to_string(keyframe_id) + " twice");
  }
  ids_.push_back(keyframe_id);
  removed_.push_back(false);
  const auto chosen =
      strongest_features(features, static_cast<std::size_t>(config_.features_per_keyframe));
  counts_.push_back(static_cast<std::uint32_t>(chosen.size()));
  live_descriptors_ += chosen.size();
  for (const auto feature : chosen) {
    const auto& descriptor = features.descriptors[feature];
    auto node = nearest_leaf(descriptor);
    if (leaves_[nodes_[node].leaf].descriptors.size() >= leaves_[nodes_[node].leaf].capacity) {
      make_room(node);
      node = nearest_leaf(descriptor);
    }
    auto& leaf = leaves_[nodes_[node].leaf];
    leaf.descriptors.push_back(descriptor);
    leaf.slots.push_back(slot);
  }
}

void PlaceIndex::remove(std::uint64_t keyframe_id) {
  const auto found = slots_.find(keyframe_id);
  if (found == slots_.end()) return;
  removed_[found->second] = true;
  live_descriptors_ -= counts_[found->second];
  slots_.erase(found);
}

std::uint32_t PlaceIndex::nearest_leaf(const Descriptor& descriptor) const {
  std::uint32_t node = 0;
  std::vector<std::uint16_t> distances(static_cast<std::size_t>(config_.branches));
  while (!nodes_[node].children.empty()) {
    const auto& centres = nodes_[node].centres;
    features::hamming_distances(descriptor, centres, std::span(distances).first(centres.size()));
    const auto end = distances.begin() + static_cast<std::ptrdiff_t>(centres.size());
    const auto nearest = std::min_element(distances.begin(), end) - distances.begin();
    node = nodes_[node].children[static_cast<std::size_t>(nearest)];
  }
  return node;
}

/// Best bin first (Beis, Lowe, CVPR 1997): every way not taken is remembered with its distance.
void PlaceIndex::nearest_leaves(const Descriptor& descriptor,
                                std::vector<std::uint32_t>& leaves) const {
  struct Way {
    std::uint16_t distance;
    std::uint32_t node;
  };
  std::vector<Way> ways = {{0, 0}};
  std::vector<std::uint16_t> distances(static_cast<std::size_t>(config_.branches));
  const auto nearer = [](const Way& a, const Way& b) { return a.distance < b.distance; };
  leaves.clear();
  while (!ways.empty() && leaves.size() < static_cast<std::size_t>(config_.probes)) {
    const auto best = std::min_element(ways.begin(), ways.end(), nearer);
    std::uint32_t node = best->node;
    ways.erase(best);
    while (!nodes_[node].children.empty()) {
      const auto& parent = nodes_[node];
      const std::span used(distances.data(), parent.centres.size());
      features::hamming_distances(descriptor, parent.centres, used);
      std::size_t nearest = 0;
      for (std::size_t i = 1; i < parent.centres.size(); ++i) {
        const bool better = distances[i] < distances[nearest];
        const std::size_t other = better ? nearest : i;
        ways.push_back({distances[other], parent.children[other]});
        if (better) nearest = i;
      }
      node = parent.children[nearest];
    }
    leaves.push_back(nodes_[node].leaf);
  }
}

void PlaceIndex::vote(const Descriptor& descriptor,
                      const std::vector<std::uint32_t>& leaves,
                      Votes& votes) const {
  ++votes.descriptor;
  votes.hits.clear();
  for (const auto index : leaves) {
    const auto& leaf = leaves_[index];
    votes.distances.resize(leaf.descriptors.size());
    features::hamming_distances(descriptor, leaf.descriptors, votes.distances);
    for (std::size_t i = 0; i < leaf.slots.size(); ++i) {
      const Slot slot = leaf.slots[i];
      if (votes.distances[i] > config_.max_distance_bits || removed_[slot]) continue;
      if (votes.seen[slot] == votes.descriptor) continue;
      votes.seen[slot] = votes.descriptor;
      votes.hits.push_back(slot);
    }
  }
  if (votes.hits.empty()) return;
  const double weight =
      std::log1p(static_cast<double>(slots_.size()) / static_cast<double>(votes.hits.size()));
  for (const auto slot : votes.hits) {
    votes.scores[slot] += weight;
    ++votes.matches[slot];
  }
}

std::vector<PlaceScore> PlaceIndex::query(const features::FrameFeatures& features) const {
  Votes votes(ids_.size());
  std::vector<std::uint32_t> leaves;
  for (const auto feature :
       strongest_features(features, static_cast<std::size_t>(config_.features_per_keyframe))) {
    nearest_leaves(features.descriptors[feature], leaves);
    vote(features.descriptors[feature], leaves, votes);
  }
  std::vector<PlaceScore> results;
  for (std::size_t slot = 0; slot < ids_.size(); ++slot) {
    if (votes.matches[slot] > 0) {
      results.push_back({ids_[slot], votes.scores[slot], votes.matches[slot]});
    }
  }
  const auto better = [](const PlaceScore& a, const PlaceScore& b) {
    return a.score != b.score ? a.score > b.score : a.keyframe_id < b.keyframe_id;
  };
  const auto count = std::min(results.size(), static_cast<std::size_t>(config_.max_results));
  std::partial_sort(
      results.begin(), results.begin() + static_cast<std::ptrdiff_t>(count), results.end(), better);
  results.resize(count);
  return results;
}

void PlaceIndex::make_room(std::uint32_t node) {
  auto& leaf = leaves_[nodes_[node].leaf];
  drop_removed(leaf);
  if (2 * leaf.descriptors.size() > leaf.capacity) divide(node);
}

void PlaceIndex::drop_removed(Leaf& leaf) const {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < leaf.slots.size(); ++i) {
    if (removed_[leaf.slots[i]]) continue;
    leaf.slots[kept] = leaf.slots[i];
    leaf.descriptors[kept++] = leaf.descriptors[i];
  }
  leaf.slots.resize(kept);
  leaf.descriptors.resize(kept);
}

void PlaceIndex::divide(std::uint32_t node) {
  auto& full = leaves_[nodes_[node].leaf];
  const auto groups = cluster(full.descriptors, static_cast<std::size_t>(config_.branches));
  if (groups.centres.size() < 2) {
    const std::size_t limit = kMaxGrowth * static_cast<std::size_t>(config_.leaf_capacity);
    if (full.capacity < limit) {
      full.capacity *= 2;
    } else {
      const auto oldest = static_cast<std::ptrdiff_t>(full.descriptors.size() / 2);
      full.descriptors.erase(full.descriptors.begin(), full.descriptors.begin() + oldest);
      full.slots.erase(full.slots.begin(), full.slots.begin() + oldest);
    }
    return;
  }
  const Leaf old = std::move(full);
  std::vector<std::uint32_t> children;
  for (std::size_t group = 0; group < groups.centres.size(); ++group) {
    // The first child takes the leaf that is free now.
    const auto leaf = group == 0 ? nodes_[node].leaf : static_cast<std::uint32_t>(leaves_.size());
    if (group > 0) leaves_.emplace_back();
    leaves_[leaf] = Leaf();
    leaves_[leaf].capacity = static_cast<std::size_t>(config_.leaf_capacity);
    children.push_back(static_cast<std::uint32_t>(nodes_.size()));
    nodes_.emplace_back().leaf = leaf;
  }
  for (std::size_t i = 0; i < old.slots.size(); ++i) {
    auto& leaf = leaves_[nodes_[children[groups.assignment[i]]].leaf];
    leaf.descriptors.push_back(old.descriptors[i]);
    leaf.slots.push_back(old.slots[i]);
  }
  nodes_[node].centres = groups.centres;
  nodes_[node].children = std::move(children);
}

std::size_t PlaceIndex::bytes() const {
  std::size_t bytes = 0;
  for (const auto& leaf : leaves_) {
    bytes += sizeof(Leaf) + leaf.descriptors.capacity() * sizeof(Descriptor) +
             leaf.slots.capacity() * sizeof(Slot);
  }
  for (const auto& node : nodes_) {
    bytes += sizeof(Node) + node.centres.capacity() * sizeof(Descriptor) +
             node.children.capacity() * sizeof(std::uint32_t);
  }
  return bytes + ids_.size() * (sizeof(std::uint64_t) + sizeof(std::uint32_t));
}

std::vector<std::size_t> strongest_features(const features::FrameFeatures& features,
                                            std::size_t count) {
  std::vector<std::size_t> order(features.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (order.size() <= count) return order;
  const auto stronger = [&](std::size_t a, std::size_t b) {
    const float response_a = features.key_points[a].response;
    const float response_b = features.key_points[b].response;
    return response_a != response_b ? response_a > response_b : a < b;
  };
  std::nth_element(
      order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(), stronger);
  order.resize(count);
  std::sort(order.begin(), order.end());
  return order;
}

}  // namespace camvox::loop
