#pragma once

#include <functional>
#include <map>
#include <set>
#include <vector>

#include "camvox/mapping/map.hpp"
#include "camvox/mapping/observation_model.hpp"

/// What is done to keyframes: dropping redundant ones, moving them, and cutting out the part of the
/// map that tracking needs.
namespace camvox::mapping {

/// Drops neighbours of `id` that are redundant: of their points (with depth, if any has) more than
/// `max_redundancy` are seen by `redundancy_observers` others at the same or a finer scale. Old
/// neighbours count as well, so that going the same way again does not grow the map. Where the
/// world looks different each time none is redundant: then of more than `place_keyframes` that look
/// the same way from the place of `id`, those go whose own landmarks were found most seldom. Keeps
/// the root, `id` and those in `keep`. Returns whom it dropped, by id.
std::vector<KeyframeId> cull_keyframes(Map& map,
                                       const ObservationModel& model,
                                       KeyframeId id,
                                       const std::set<KeyframeId>& keep);

/// New poses of keyframes.
using KeyframePoses = std::map<KeyframeId, geometry::SE3>;

/// Gives keyframes their new poses. A keyframe without one moves with its parent in the spanning
/// tree if `follows` says so, else it stays. Landmarks move with their reference keyframe, except
/// those that `placed` has (they got a position of their own). Returns whom it moved.
std::set<KeyframeId> move_keyframes(Map& map,
                                    const KeyframePoses& new_poses,
                                    const std::function<bool(KeyframeId)>& follows,
                                    const std::map<LandmarkId, Eigen::Vector3d>& placed = {});

/// The landmarks and poses around a keyframe: it, its neighbours, theirs, its relatives in the
/// tree; bounded by the config. When `reference` was dropped from the map, its heir's surroundings,
/// and the pose where it would be now. An empty map gives an empty local map.
[[nodiscard]] tracking::LocalMap extract_local_map(const Map& map,
                                                   const MappingConfig& config,
                                                   KeyframeId reference);

}  // namespace camvox::mapping
