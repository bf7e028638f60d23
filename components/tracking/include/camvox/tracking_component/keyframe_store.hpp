#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "camvox/tracking/keyframe.hpp"

namespace camvox::tracking_component {

/// Keeps the newest keyframes that were sent, for a mapping that has lost them: it was restarted,
/// or the link to it was cut. What mapping has, its local maps say.
class KeyframeStore {
 public:
  /// So many keyframes are sent again at a time: a reader's queue must hold them.
  static constexpr std::size_t kBatch = 8;
  /// A batch is given that many frames to arrive before it is sent once more.
  static constexpr std::uint64_t kFramesToArrive = 20;

  /// Of more than `capacity` keyframes the oldest goes.
  explicit KeyframeStore(std::size_t capacity) : capacity_(capacity) {}

  /// Takes a keyframe that was just sent.
  void add(tracking::Keyframe keyframe);

  /// Forgets one that mapping lacks, and ties what was taken from it to its parent: so the others
  /// make a connected map without it.
  void drop(tracking::KeyframeId id);

  /// For keyframes of another map, whose ids mean others now.
  void clear() { *this = KeyframeStore(capacity_); }

  /// What mapping shall get again, oldest first, from what its newest local map says: it has dealt
  /// with all keyframes below `next_id`, and has seen frame `map_frame_id`. `frame_id`: the frame
  /// that tracking has come to.
  [[nodiscard]] std::vector<const tracking::Keyframe*> missing(tracking::KeyframeId next_id,
                                                               std::uint64_t map_frame_id,
                                                               std::uint64_t frame_id);

  [[nodiscard]] std::size_t size() const { return keyframes_.size(); }

 private:
  std::size_t capacity_;
  std::deque<tracking::Keyframe> keyframes_;  // by id
  tracking::KeyframeId sent_again_ = 0;       // the newest of the last batch
  std::uint64_t sent_again_at_ = 0;           // frame of the last batch
};

}  // namespace camvox::tracking_component
