#include "camvox/loop_closing/messages.hpp"

#include <algorithm>
#include <stdexcept>

#include "camvox/conversion/pose.hpp"

namespace camvox::loop_closing {
namespace {

using conversion::to_array;
using conversion::to_se3;

}  // namespace

loop::MapChange to_map_change(const camvox_interfaces::msg::MapUpdate& message) {
  if (message.keyframe_ids_count() != message.keyframe_poses_count()) {
    throw std::invalid_argument("map update: lists of different length");
  }
  loop::MapChange change;
  change.map_epoch = message.map_epoch();
  for (std::uint32_t i = 0; i < message.keyframe_ids_count(); ++i) {
    change.T_map_camera.emplace_back(message.keyframe_ids()[i],
                                     to_se3(message.keyframe_poses()[i]));
  }
  const auto* removed = message.removed_keyframe_ids().data();
  change.removed.assign(removed, removed + message.removed_keyframe_ids_count());
  for (std::uint32_t i = 0; i < message.edges_count(); ++i) {
    const auto& edge = message.edges()[i];
    change.edges.push_back(
        {edge[0], edge[1], static_cast<int>(std::min<std::uint64_t>(edge[2], 1000000))});
  }
  return change;
}

bool write(const loop::Correction& correction, camvox_interfaces::msg::LoopCorrection& message) {
  if (correction.T_map_camera.size() > camvox_interfaces::msg::CORRECTION_KEYFRAMES) return false;
  message.map_epoch(correction.map_epoch);
  message.query_keyframe_id(correction.loop.query_id);
  message.match_keyframe_id(correction.loop.match_id);
  message.T_match_query() = to_array(correction.loop.T_match_query);
  message.covariance_query() = to_array(correction.loop.covariance_query);
  message.by_surfaces(correction.loop.by_surfaces ? 1 : 0);
  std::uint32_t count = 0;
  for (const auto& [id, T_map_camera] : correction.T_map_camera) {
    message.keyframe_ids()[count] = id;
    message.keyframe_poses()[count++] = to_array(T_map_camera);
  }
  message.keyframe_ids_count(count);
  message.keyframe_poses_count(count);
  return true;
}

void write(const loop::Relocalisation& relocalisation,
           camvox_interfaces::msg::RelocalisationAnswer& message) {
  message.T_map_camera() = to_array(relocalisation.T_map_camera);
  message.covariance_camera() = to_array(relocalisation.covariance_camera);
  message.inliers(static_cast<std::uint32_t>(relocalisation.inliers));
  message.found(1);
  const auto count = std::min<std::size_t>(relocalisation.keyframe_ids.size(),
                                           camvox_interfaces::msg::RELOCALISATION_KEYFRAMES);
  std::copy_n(relocalisation.keyframe_ids.begin(), count, message.keyframe_ids().begin());
  message.keyframe_ids_count(static_cast<std::uint32_t>(count));
}

}  // namespace camvox::loop_closing
