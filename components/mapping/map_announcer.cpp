#include "camvox/mapping_component/map_announcer.hpp"

#include <stdexcept>
#include <string>

#include "camvox/conversion/map_messages.hpp"
#include "map_update_message.hpp"

namespace camvox::mapping_component {
namespace {

using camvox_interfaces::msg::Keyframe;

/// Keyframes under way at a time; far below the queue's length.
constexpr std::size_t kMaxInFlight = 8;

}  // namespace

MapAnnouncer::MapAnnouncer(Context& context)
    : context_(context),
      keyframes_(context.advertise<Keyframe>({"map_keyframe", topics::kMapKeyframe},
                                             {.qos = qos::kKeyframes})) {}

void MapAnnouncer::begin(const mapping::Mapper& mapper, Publisher<MapUpdate>& updates) {
  mapper_ = &mapper;
  updates_ = &updates;
  const auto order = mapper.map().parents_first();
  if (order.empty()) return;
  waiting_.assign(order.begin(), order.end());
  stage_ = Stage::kKeyframes;
  advance();
}

void MapAnnouncer::acknowledge(tracking::KeyframeId id) {
  if (in_flight_.erase(id) == 0) return;
  progressed_ = true;
  advance();
}

void MapAnnouncer::repeat() {
  if (done() || std::exchange(progressed_, false)) return;
  if (stage_ == Stage::kUpdate)
    publish_changes(mapper_->all_changes(), mapper_->epoch(), {}, *updates_);
  for (const auto id : in_flight_) send(id);
}

void MapAnnouncer::advance() {
  while (!waiting_.empty() && in_flight_.size() < kMaxInFlight) {
    in_flight_.insert(waiting_.front());
    send(waiting_.front());
    waiting_.pop_front();
  }
  if (!in_flight_.empty()) return;
  if (stage_ == Stage::kUpdate) {
    stage_ = Stage::kDone;
    return;
  }
  stage_ = Stage::kUpdate;
  publish_changes(mapper_->all_changes(), mapper_->epoch(), {}, *updates_);
  waiting_.push_back(mapper_->map().keyframes().begin()->first);
  advance();
}

void MapAnnouncer::send(tracking::KeyframeId id) {
  const auto& keyframe = mapper_->map().keyframe(id);
  auto announced = keyframe.frame;
  announced.parent_id = keyframe.parent;
  announced.map_epoch = mapper_->epoch();
  auto message = keyframes_.loan();
  if (!conversion::write_keyframe(announced, *message)) {
    throw std::runtime_error("keyframe " + std::to_string(id) + " of the loaded map has " +
                             std::to_string(announced.features.size()) +
                             " features: more than a message can carry");
  }
  keyframes_.publish(std::move(message));
}

}  // namespace camvox::mapping_component
