#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace camvox::import {

/// Focal length and principal point of a camera without distortion.
struct Pinhole {
  int width_px = 640;
  int height_px = 480;
  double fx_px = 525.0;
  double fy_px = 525.0;
  double cx_px = 320.0;
  double cy_px = 240.0;
};

/// How a depth camera sees next to a colour camera. The two look the same way.
struct DepthRegistration {
  Pinhole depth;
  Pinhole camera;
  /// Of the depth camera in the colour camera's optical frame.
  std::array<double, 3> p_camera_depth_m = {0.0, 0.0, 0.0};
};

/// Moves a depth image into the colour camera: each pixel becomes a point, which is projected and
/// rounded to the nearest pixel; where several fall on one, the nearest wins (z-buffer). Depth is
/// along the optical axis in millimetres, 0 and 65535 mean none. A pixel that no point falls on
/// stays 0: nothing is filled in. The result has the colour camera's size. Throws std::logic_error
/// if the size of the image is not that of the depth camera.
[[nodiscard]] std::vector<std::uint16_t> register_depth(const DepthRegistration& rig,
                                                        std::span<const std::uint16_t> depth_mm);

}  // namespace camvox::import
