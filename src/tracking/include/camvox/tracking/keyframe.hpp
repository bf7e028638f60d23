#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"

namespace camvox::tracking {

using KeyframeId = std::uint64_t;  ///< Counts from 1; 0: none.
using LandmarkId = std::uint64_t;  ///< See landmark_id; 0: none.

/// The id of the landmark that feature number `feature` of a keyframe founded. So tracking can
/// make landmarks, and mapping keep them, without asking each other.
[[nodiscard]] constexpr LandmarkId landmark_id(KeyframeId keyframe, std::size_t feature) {
  return (keyframe << 16U) | feature;
}
[[nodiscard]] constexpr KeyframeId founding_keyframe(LandmarkId id) { return id >> 16U; }
[[nodiscard]] constexpr std::size_t founding_feature(LandmarkId id) { return id & 0xFFFFU; }

/// Ties a keyframe that was taken from `gone` to the parent of that one.
template <typename Gone, typename Child>
void tie_to_parent_of(const Gone& gone, Child& child) {
  child.parent_id = gone.parent_id;
  child.T_parent_camera = gone.T_parent_camera * child.T_parent_camera;
}

/// A frame that becomes part of the map, or that shall be relocalised.
struct Keyframe {
  KeyframeId id = 0;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::uint64_t map_epoch = 0;
  KeyframeId parent_id = 0;  ///< The reference keyframe when it was taken; 0 for the first.
  geometry::SE3 T_map_camera;
  geometry::SE3 T_parent_camera;
  geometry::Matrix6d covariance_camera = geometry::Matrix6d::Zero();
  features::FrameFeatures features;
  /// What feature i shows. A known landmark; or, where the entry is landmark_id(id, i), a new one,
  /// to be made with landmark_from_depth; or 0: nothing known. Depth may be present in any case.
  std::vector<LandmarkId> landmark_ids;
};

}  // namespace camvox::tracking
