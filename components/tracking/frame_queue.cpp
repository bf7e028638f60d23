#include "camvox/tracking_component/frame_queue.hpp"

namespace camvox::tracking_component {

namespace msg = camvox_interfaces::msg;

void FrameQueue::add(const Sample<msg::FrameImage>& image) {
  const auto& header = image->header();
  if (header.frame_id() <= last_taken_ && header.stamp_ns() > last_stamp_ns_) begin_ids_anew();
  if (auto* inputs = slot(header.frame_id())) {
    inputs->image = image;
  } else {
    ++dropped_;
  }
}

/// No late image can be newer than what was taken: sync was started anew, and counts from 1 again.
void FrameQueue::begin_ids_anew() {
  while (!frames_.empty()) drop_oldest();
  last_taken_ = 0;
}

void FrameQueue::add(const Sample<msg::DepthImage>& depth) {
  if (auto* inputs = slot(depth->header().frame_id())) inputs->depth = depth;
}

void FrameQueue::add(const Sample<msg::Cloud>& cloud) {
  if (auto* inputs = slot(cloud->header().frame_id())) inputs->cloud = cloud;
}

/// Nothing for a frame that is over.
FrameInputs* FrameQueue::slot(std::uint64_t frame_id) {
  if (frame_id <= last_taken_) return nullptr;
  auto* inputs = &frames_[frame_id];
  if (frames_.size() > kCapacity) {
    if (frames_.begin()->first == frame_id) inputs = nullptr;
    drop_oldest();
  }
  return inputs;
}

void FrameQueue::drop_oldest() {
  if (frames_.begin()->second.image) ++dropped_;
  frames_.erase(frames_.begin());
}

bool FrameQueue::complete(const FrameInputs& inputs) const {
  return inputs.image && inputs.depth && (inputs.cloud || !needs_cloud_);
}

std::optional<std::uint64_t> FrameQueue::next() const {
  if (keep_all_) {
    if (frames_.empty() || !complete(frames_.begin()->second)) return std::nullopt;
    return frames_.begin()->first;
  }
  std::optional<std::uint64_t> newest;
  for (const auto& [id, inputs] : frames_) {
    if (complete(inputs)) newest = id;
  }
  if (!newest) return std::nullopt;
  // An older frame that lacks only its depth was waited for long enough: it goes first.
  for (const auto& [id, inputs] : frames_) {
    if (id >= *newest) break;
    if (inputs.image && !inputs.depth) return id;
  }
  return newest;
}

FrameInputs FrameQueue::take(std::uint64_t frame_id) {
  while (!frames_.empty() && frames_.begin()->first < frame_id) drop_oldest();
  FrameInputs inputs = std::move(frames_.begin()->second);
  frames_.erase(frames_.begin());
  last_taken_ = frame_id;
  if (inputs.image) last_stamp_ns_ = (*inputs.image)->header().stamp_ns();
  return inputs;
}

}  // namespace camvox::tracking_component
