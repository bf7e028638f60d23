#include "camvox/loop_closing/map_order.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace camvox::loop_closing {

void MapOrder::add(tracking::Keyframe keyframe) {
  const auto id = keyframe.id;
  if (known_.contains(id)) return;  // it came twice, or was given up
  keyframes_.insert_or_assign(id, std::move(keyframe));
}

void MapOrder::add(loop::MapChange change, std::uint64_t frame_id) {
  changes_.push_back({std::move(change), frame_id});
}

bool MapOrder::complete(const loop::MapChange& change) const {
  return std::all_of(
      change.T_map_camera.begin(), change.T_map_camera.end(), [&](const auto& listed) {
        return known_.contains(listed.first) || keyframes_.contains(listed.first);
      });
}

void MapOrder::take(tracking::KeyframeId id, Step& step) {
  if (!known_.insert(id).second) return;
  if (auto found = keyframes_.extract(id)) {
    step.keyframes.push_back(std::move(found.mapped()));
  } else {
    ++unpaired_;
  }
}

std::optional<MapOrder::Step> MapOrder::next() {
  Step step;
  if (!changes_.empty()) {
    auto& first = changes_.front();
    if (!complete(first.change) && changes_.size() <= patience_) return std::nullopt;
    for (const auto& [id, T_map_camera] : first.change.T_map_camera) take(id, step);
    for (const auto id : first.change.removed) known_.erase(id);
    for (auto it = keyframes_.begin(); it != keyframes_.end();) {
      const auto next = std::next(it);
      if (it->second.frame_id < first.frame_id) {
        step.refused.push_back(std::move(keyframes_.extract(it).mapped()));
      }
      it = next;
    }
    step.change = std::move(first.change);
    changes_.pop_front();
    return step;
  }
  if (keyframes_.size() <= patience_) return std::nullopt;
  take(keyframes_.begin()->first, step);
  ++unpaired_;
  return step;
}

}  // namespace camvox::loop_closing
