#pragma once

#include "camvox/calibration/scene.hpp"
#include "camvox/geometry/se3.hpp"
#include "camvox/sensors/camera_model.hpp"

namespace camvox::calibration {

/// Normalised information distance between the reflectivity of the returns and the grey value of
/// the pixels they project to: 0 if one tells all of the other, 1 if nothing (or if too few
/// project into the image). Source: Koide et al., "General, single-shot, target-less, and
/// automatic lidar-camera extrinsic calibration toolbox", ICRA 2023, equation 3; returns behind
/// nearer ones are not removed.
[[nodiscard]] double normalised_information_distance(const Scene& scene,
                                                     const sensors::CameraModel& camera,
                                                     const geometry::SE3& T_camera_lidar);

}  // namespace camvox::calibration
