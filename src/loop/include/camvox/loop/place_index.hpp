#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/features/feature.hpp"

namespace camvox::loop {

/// Tuning of PlaceIndex. YAML keys are the field names.
struct PlaceIndexConfig {
  int features_per_keyframe = 600;  ///< Strongest ones that are indexed, and that are looked up.
  int leaf_capacity = 128;          ///< A leaf with more descriptors is divided.
  int branches = 8;                 ///< Children of a divided leaf.
  int probes = 2;                   ///< Leaves that are searched for a descriptor.
  int max_distance_bits = 52;       ///< Descriptors farther apart show different things.
  int max_results = 200;            ///< Keyframes that a query returns at most.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("features_per_keyframe",
          self.features_per_keyframe,
          config::at_least(1),
          config::at_most(4096));
    field("leaf_capacity", self.leaf_capacity, config::at_least(16), config::at_most(4096));
    field("branches", self.branches, config::at_least(2), config::at_most(64));
    field("probes", self.probes, config::at_least(1), config::at_most(16));
    field("max_distance_bits", self.max_distance_bits, config::at_least(0), config::at_most(256));
    field("max_results", self.max_results, config::at_least(1), config::at_most(100000));
  }
};

/// How much a keyframe looks like the query.
struct PlaceScore {
  std::uint64_t keyframe_id = 0;
  double score = 0.0;  ///< Sum of the matches' weights; rare descriptors weigh more.
  int matches = 0;     ///< Descriptors of the query that have a near one in the keyframe.
};

/// Finds the keyframes that look like an image. Needs no vocabulary: a tree over the descriptors
/// themselves grows with the map. A leaf that is full is divided by k-majority clustering (Grana et
/// al., 2013), so the tree is fine where the map has many alike descriptors. A query descriptor
/// searches the few leaves nearest to it and votes for the keyframes of the near descriptors in
/// them, weighted by rarity as tf-idf does; unlike a bag of words it compares descriptors, not
/// names of cells. (HBST: Schlegel, Grisetti, RA-L 2018, had the idea of a tree over the map's own
/// descriptors; it divides by single bits.)
///
/// The work of a query grows with the logarithm of the number of descriptors. Deterministic.
/// Not thread-safe. It is not saved with a map: building it again takes 1 to 2 ms per keyframe.
class PlaceIndex {
 public:
  /// Throws config::ConfigError.
  explicit PlaceIndex(const PlaceIndexConfig& config = {});

  /// Adds a keyframe. Throws std::logic_error when it is there already.
  void insert(std::uint64_t keyframe_id, const features::FrameFeatures& features);
  /// Forgets a keyframe; unknown ids are ignored.
  void remove(std::uint64_t keyframe_id);

  /// The keyframes that share near descriptors with `features`, best first (ties: lower id).
  [[nodiscard]] std::vector<PlaceScore> query(const features::FrameFeatures& features) const;

  [[nodiscard]] std::size_t keyframes() const { return slots_.size(); }
  [[nodiscard]] std::size_t descriptors() const { return live_descriptors_; }
  /// Memory of descriptors and tree.
  [[nodiscard]] std::size_t bytes() const;

 private:
  using Slot = std::uint32_t;  ///< A keyframe's place in the arrays below.
  struct Leaf {
    std::vector<features::Descriptor> descriptors;
    std::vector<Slot> slots;
    std::size_t capacity = 0;
  };
  struct Node {
    std::vector<features::Descriptor> centres;  ///< Of the children; none: a leaf.
    std::vector<std::uint32_t> children;
    std::uint32_t leaf = 0;
  };
  struct Votes;

  [[nodiscard]] std::uint32_t nearest_leaf(const features::Descriptor& descriptor) const;
  void nearest_leaves(const features::Descriptor& descriptor,
                      std::vector<std::uint32_t>& leaves) const;
  void vote(const features::Descriptor& descriptor,
            const std::vector<std::uint32_t>& leaves,
            Votes& votes) const;
  void make_room(std::uint32_t node);
  void drop_removed(Leaf& leaf) const;
  void divide(std::uint32_t node);

  PlaceIndexConfig config_;
  std::vector<Node> nodes_;
  std::vector<Leaf> leaves_;
  std::unordered_map<std::uint64_t, Slot> slots_;  ///< Looked up only, never iterated.
  std::vector<std::uint64_t> ids_;                 ///< By slot.
  std::vector<bool> removed_;                      ///< By slot.
  std::vector<std::uint32_t> counts_;              ///< Descriptors indexed, by slot.
  std::size_t live_descriptors_ = 0;
};

/// The indices of the `count` strongest features, ascending.
[[nodiscard]] std::vector<std::size_t> strongest_features(const features::FrameFeatures& features,
                                                          std::size_t count);

}  // namespace camvox::loop
