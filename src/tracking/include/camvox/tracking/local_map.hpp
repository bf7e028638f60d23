#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/optimization/point_observation.hpp"
#include "camvox/tracking/keyframe.hpp"

namespace camvox::tracking {

/// A point of the map, with what is needed to find it in an image again.
struct Landmark {
  LandmarkId id = 0;
  Eigen::Vector3d p_map = Eigen::Vector3d::Zero();
  /// Mean of the unit vectors from the cameras that saw it to the landmark, map axes.
  Eigen::Vector3f f_map = Eigen::Vector3f::Zero();
  float min_distance_m =
      0.0F;  ///< Nearer than this its patch is larger than the coarsest octave's.
  float max_distance_m = 0.0F;  ///< Farther than this its patch is smaller than octave 0's.
  float sigma_m = 0.0F;         ///< Standard deviation of p_map along f_map.
  features::Descriptor descriptor;
};

/// The part of the map around a reference keyframe, which tracking matches against.
struct LocalMap {
  struct KeyframePose {
    KeyframeId id = 0;
    geometry::SE3 T_map_camera;
  };

  std::uint64_t frame_id = 0;  ///< The newest frame whose keyframe, if it made one, is included.
  std::uint64_t map_epoch = 0;
  KeyframeId reference_keyframe_id = 0;
  KeyframeId next_keyframe_id = 0;      ///< Mapping has dealt with all keyframes below, no others.
  std::vector<KeyframePose> keyframes;  ///< With the reference; ids ascend.
  std::vector<Landmark> landmarks;      ///< Ids ascend.
};

/// Steps between the levels of the image pyramid, and how many there are.
struct ScaleLevels {
  float factor = 1.2F;
  int levels = 8;
};

/// The range of distances [m] at which a patch seen in `octave` from `distance_m` is as large as
/// one of the pyramid's octaves: max = distance * factor^octave, min = max / factor^(levels - 1).
struct DistanceRange {
  float min_m = 0.0F;
  float max_m = 0.0F;
};
[[nodiscard]] DistanceRange distance_range(float distance_m, int octave, const ScaleLevels& scale);

/// The octave in which a patch of that range is seen from `distance_m`, 0 to levels - 1.
[[nodiscard]] int predicted_octave(float distance_m,
                                   float max_distance_m,
                                   const ScaleLevels& scale);

/// The landmark that feature `feature` of `keyframe` founds with its depth; nothing when it has no
/// depth. Tracking and mapping both make it with this function, so that their copies agree.
[[nodiscard]] std::optional<Landmark> landmark_from_depth(const Keyframe& keyframe,
                                                          std::size_t feature,
                                                          const optimization::PinholeCamera& camera,
                                                          const ScaleLevels& scale);

}  // namespace camvox::tracking
