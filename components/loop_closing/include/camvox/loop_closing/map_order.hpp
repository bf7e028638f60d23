#pragma once

#include <cstddef>
#include <deque>
#include <map>
#include <optional>
#include <set>
#include <vector>

#include "camvox/loop/map_replica.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::loop_closing {

/// Brings keyframes (from tracking) and changes of the map (from mapping), which arrive in any
/// order relative to each other, into the one order that the map has: a keyframe belongs to the
/// first change that lists it; one of an earlier frame that no change lists was refused. So a run
/// can be repeated, however messages were delayed.
class MapOrder {
 public:
  /// What happened next: `keyframes` came into the map with `change`.
  struct Step {
    std::vector<tracking::Keyframe> keyframes;
    std::vector<tracking::Keyframe> refused;  ///< Mapping went on without them.
    loop::MapChange change;
  };

  /// A keyframe is handled without its change when more than `patience` later ones wait (mapping
  /// does not answer), a change without its keyframe when more than `patience` later ones wait (it
  /// was lost).
  explicit MapOrder(std::size_t patience) : patience_(patience) {}

  /// One that is in the map already changes nothing.
  void add(tracking::Keyframe keyframe);
  /// `frame_id`: the frame that the map has come to.
  void add(loop::MapChange change, std::uint64_t frame_id);
  /// A keyframe that needs no change, from a loaded map, is in the map now.
  void know(tracking::KeyframeId id) { known_.insert(id); }

  /// The next step, when all of it has arrived.
  [[nodiscard]] std::optional<Step> next();

  [[nodiscard]] std::size_t waiting() const { return keyframes_.size() + changes_.size(); }
  /// Keyframes and changes that the other one did not come for.
  [[nodiscard]] std::size_t unpaired() const { return unpaired_; }

 private:
  struct Waiting {
    loop::MapChange change;
    std::uint64_t frame_id;
  };
  [[nodiscard]] bool complete(const loop::MapChange& change) const;
  void take(tracking::KeyframeId id, Step& step);

  std::size_t patience_;
  std::map<tracking::KeyframeId, tracking::Keyframe> keyframes_;
  std::deque<Waiting> changes_;
  std::set<tracking::KeyframeId> known_;  ///< In the map, or given up.
  std::size_t unpaired_ = 0;
};

}  // namespace camvox::loop_closing
