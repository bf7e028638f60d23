#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::loop {

using KeyframeId = tracking::KeyframeId;

/// What the owner of the map says has changed.
struct MapChange {
  struct Edge {
    KeyframeId a = 0;
    KeyframeId b = 0;
    int shared_landmarks = 0;  ///< 0: they share none any more.
  };
  std::uint64_t map_epoch = 0;
  std::vector<std::pair<KeyframeId, geometry::SE3>> T_map_camera;
  std::vector<KeyframeId> removed;
  std::vector<Edge> edges;
};

/// Loop closing's own copy of what it needs of the map: features and poses of the keyframes, the
/// tree of their parents, and which see the same landmarks. About 70 bytes per feature.
class MapReplica {
 public:
  struct Keyframe {
    std::shared_ptr<const features::FrameFeatures> features;
    geometry::SE3 T_map_camera;
    KeyframeId parent = 0;          ///< 0: the oldest has none.
    KeyframeId awaited_parent = 0;  ///< Not here yet: another stands in for it.
    geometry::Matrix6d covariance = geometry::Matrix6d::Zero();  ///< As tracking estimated it.
    std::map<KeyframeId, int> shared_landmarks;                  ///< With other keyframes.
    std::vector<KeyframeId> children;
  };

  /// Takes a keyframe in; one with the same id is replaced, and keeps its place in the tree. Until
  /// its parent comes, the next older keyframe stands in for it: a map without a tie between two
  /// parts would be torn apart there by the next correction.
  void insert(const tracking::Keyframe& keyframe);
  /// Keyframes that are not known are ignored. The children of a removed one go to its parent.
  void apply(const MapChange& change);

  [[nodiscard]] const Keyframe* find(KeyframeId id) const;
  [[nodiscard]] const std::map<KeyframeId, Keyframe>& keyframes() const { return keyframes_; }
  [[nodiscard]] std::uint64_t map_epoch() const { return map_epoch_; }

  /// The keyframes that see most of the same landmarks, most first, then parent and children; at
  /// most `count`.
  [[nodiscard]] std::vector<KeyframeId> neighbours(KeyframeId id, std::size_t count) const;

  /// Additional connections for path_lengths, e.g. loops that were accepted.
  using Connections = std::vector<std::pair<KeyframeId, KeyframeId>>;

  /// Length of the shortest path along parents, shared landmarks and `loops` (which have length 0)
  /// to every keyframe within `max_m`.
  [[nodiscard]] std::map<KeyframeId, double> path_lengths(KeyframeId from,
                                                          double max_m,
                                                          const Connections& loops) const;

  [[nodiscard]] geometry::SE3 relative_pose(KeyframeId from, KeyframeId to) const;

 private:
  void remove(KeyframeId id);
  void adopt(KeyframeId parent, KeyframeId child);

  std::map<KeyframeId, Keyframe> keyframes_;
  std::map<KeyframeId, std::set<KeyframeId>> awaited_;  ///< Children by the parent they lack.
  std::uint64_t map_epoch_ = 0;
};

}  // namespace camvox::loop
