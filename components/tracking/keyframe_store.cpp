#include "camvox/tracking_component/keyframe_store.hpp"

#include <algorithm>
#include <utility>

namespace camvox::tracking_component {

void KeyframeStore::add(tracking::Keyframe keyframe) {
  if (capacity_ == 0) return;
  if (keyframes_.size() >= capacity_) keyframes_.pop_front();
  keyframes_.push_back(std::move(keyframe));
}

void KeyframeStore::drop(tracking::KeyframeId id) {
  const auto found = std::find_if(keyframes_.begin(), keyframes_.end(), [id](const auto& keyframe) {
    return keyframe.id == id;
  });
  if (found == keyframes_.end()) return;
  for (auto& keyframe : keyframes_) {
    if (keyframe.parent_id == id) tracking::tie_to_parent_of(*found, keyframe);
  }
  keyframes_.erase(found);
}

std::vector<const tracking::Keyframe*> KeyframeStore::missing(tracking::KeyframeId next_id,
                                                              std::uint64_t map_frame_id,
                                                              std::uint64_t frame_id) {
  const auto first = std::find_if(keyframes_.begin(), keyframes_.end(), [&](const auto& keyframe) {
    return keyframe.id >= next_id;
  });
  // Mapping may not have come to the frame of this keyframe yet.
  if (first == keyframes_.end() || first->frame_id > map_frame_id) return {};
  const bool under_way = first->id <= sent_again_ && frame_id < sent_again_at_ + kFramesToArrive;
  if (under_way) return {};
  std::vector<const tracking::Keyframe*> batch;
  for (auto it = first; it != keyframes_.end() && batch.size() < kBatch; ++it) {
    if (it->frame_id <= map_frame_id) batch.push_back(&*it);
  }
  sent_again_ = batch.back()->id;
  sent_again_at_ = frame_id;
  return batch;
}

}  // namespace camvox::tracking_component
