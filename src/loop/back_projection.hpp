#pragma once

#include <Eigen/Core>

#include "camvox/optimization/point_observation.hpp"

namespace camvox::loop {

/// Where an undistorted pixel looks, in the camera frame, z = 1.
[[nodiscard]] inline Eigen::Vector3d ray(const Eigen::Vector2f& u_px,
                                         const optimization::PinholeCamera& camera) {
  return {(u_px.x() - camera.cx_px) / camera.fx_px, (u_px.y() - camera.cy_px) / camera.fy_px, 1.0};
}

}  // namespace camvox::loop
