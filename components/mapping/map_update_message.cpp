#include "map_update_message.hpp"

#include <algorithm>

#include "camvox/conversion/pose.hpp"

namespace camvox::mapping_component {
namespace {

namespace msg = camvox_interfaces::msg;

/// Part number `part` of `count` things, `capacity` a part.
struct Range {
  std::size_t begin;
  std::size_t end;
};
Range part_of(std::size_t count, std::size_t part, std::size_t capacity) {
  return {std::min(count, part * capacity), std::min(count, (part + 1) * capacity)};
}

void write_part(const mapping::MapChanges& changes, std::size_t part, msg::MapUpdate& message) {
  std::uint32_t written = 0;
  const auto keyframes = part_of(changes.keyframes.size(), part, msg::MAP_UPDATE_KEYFRAMES);
  for (std::size_t i = keyframes.begin; i < keyframes.end; ++i, ++written) {
    message.keyframe_ids()[written] = changes.keyframes[i].id;
    message.keyframe_poses()[written] = conversion::to_array(changes.keyframes[i].T_map_camera);
  }
  message.keyframe_ids_count(written);
  message.keyframe_poses_count(written);
  written = 0;
  const auto removed = part_of(changes.removed.size(), part, msg::MAP_UPDATE_KEYFRAMES);
  for (std::size_t i = removed.begin; i < removed.end; ++i) {
    message.removed_keyframe_ids()[written++] = changes.removed[i];
  }
  message.removed_keyframe_ids_count(written);
  written = 0;
  const auto edges = part_of(changes.edges.size(), part, msg::MAP_UPDATE_EDGES);
  for (std::size_t i = edges.begin; i < edges.end; ++i) {
    const auto& edge = changes.edges[i];
    message.edges()[written++] = {edge.a, edge.b, static_cast<std::uint64_t>(edge.shared)};
  }
  message.edges_count(written);
}

}  // namespace

void publish_changes(const mapping::MapChanges& changes,
                     std::uint64_t map_epoch,
                     const msg::MessageHeader& header,
                     Publisher<msg::MapUpdate>& publisher) {
  if (changes.empty()) return;
  const auto parts = [](std::size_t count, std::size_t capacity) {
    return (count + capacity - 1) / capacity;
  };
  const std::size_t count = std::max({parts(changes.keyframes.size(), msg::MAP_UPDATE_KEYFRAMES),
                                      parts(changes.removed.size(), msg::MAP_UPDATE_KEYFRAMES),
                                      parts(changes.edges.size(), msg::MAP_UPDATE_EDGES)});
  for (std::size_t part = 0; part < count; ++part) {
    auto message = publisher.loan();
    message->header() = header;
    message->map_epoch(map_epoch);
    write_part(changes, part, *message);
    publisher.publish(std::move(message));
  }
}

}  // namespace camvox::mapping_component
