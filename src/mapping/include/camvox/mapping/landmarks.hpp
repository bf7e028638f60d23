#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "camvox/mapping/map.hpp"
#include "camvox/mapping/observation_model.hpp"

/// What is done to landmarks when a keyframe comes in. All functions keep the map consistent, and
/// go through keyframes and landmarks in order of their ids.
namespace camvox::mapping {

/// Brings a landmark's view, range of distances, uncertainty and descriptor up to date with its
/// observations: mean direction, range from its reference keyframe, the descriptor of least median
/// distance; sigma along the view from all depths and all parallaxes.
void refresh_landmark(Map& map, const ObservationModel& model, LandmarkId id);
/// The same for all that a keyframe sees.
void refresh_landmarks_of(Map& map, const ObservationModel& model, KeyframeId id);

/// Counts, for the landmarks of the keyframe's neighbourhood that lie in its view, whether it found
/// them: the numbers that cull_young_landmarks judges by.
void count_sightings(Map& map, const ObservationModel& model, KeyframeId id);

/// Drops landmarks of the last three keyframes that were found too seldom or are seen by too few.
/// Returns how many.
std::size_t cull_young_landmarks(Map& map, const ObservationModel& model, KeyframeId newest);

/// Makes landmarks of features of `id` that show none yet, together with such features of its
/// neighbours: matches along epipolar lines, then two-view triangulation or lidar depth, whichever
/// is more certain; checked for parallax, reprojection (chi-square 5.991) and scale. Returns how
/// many.
std::size_t triangulate_landmarks(Map& map, const ObservationModel& model, KeyframeId id);

/// Searches each of `landmarks` in a keyframe; where the feature found shows another landmark, the
/// one seen more often stays. Returns how many observations and fusions that gave.
std::size_t fuse_into(Map& map,
                      const ObservationModel& model,
                      KeyframeId id,
                      std::span<const LandmarkId> landmarks,
                      double radius_px);
/// fuse_into between a keyframe and its neighbours, both ways.
std::size_t fuse_with_neighbours(Map& map, const ObservationModel& model, KeyframeId id);

/// All landmarks that some keyframes see, ascending.
[[nodiscard]] std::vector<LandmarkId> landmarks_seen_by(const Map& map,
                                                        std::span<const KeyframeId> keyframes);

}  // namespace camvox::mapping
