#include "camvox/import/depth_registration.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace camvox::import {
namespace {

DepthRegistration kinect() {
  DepthRegistration rig;
  rig.depth.fx_px = rig.depth.fy_px = 585.0;
  rig.p_camera_depth_m = {-0.025, 0.0, 0.0};
  return rig;
}

std::size_t at(int u, int v, int width = 640) {
  return static_cast<std::size_t>(v) * static_cast<std::size_t>(width) +
         static_cast<std::size_t>(u);
}

TEST(RegisterDepth, SameCameraChangesNothing) {
  DepthRegistration rig;
  std::vector<std::uint16_t> depth(640 * 480);
  for (std::size_t i = 0; i < depth.size(); ++i)
    depth[i] = static_cast<std::uint16_t>(500 + i % 5000);
  EXPECT_EQ(register_depth(rig, depth), depth);
}

// A tilted plane n.p = d in the depth camera has a closed form in the colour camera as well: depth
// along the ray f is (d + n.t) / (n.f).
TEST(RegisterDepth, TiltedPlaneHasItsClosedForm) {
  const auto rig = kinect();
  const double n[3] = {0.3, -0.1, 1.0}, d_m = 2.0;
  std::vector<std::uint16_t> depth(640 * 480);
  for (int v = 0; v < 480; ++v) {
    for (int u = 0; u < 640; ++u) {
      const double z_m = d_m / (n[0] * (u - 320) / 585.0 + n[1] * (v - 240) / 585.0 + n[2]);
      depth[at(u, v)] = static_cast<std::uint16_t>(std::lround(1e3 * z_m));
    }
  }
  const auto registered = register_depth(rig, depth);
  int seen = 0;
  for (int v = 40; v < 440; ++v) {
    for (int u = 60; u < 580; ++u) {
      if (registered[at(u, v)] == 0) continue;
      ++seen;
      const double z_m =
          (d_m + n[0] * -0.025) / (n[0] * (u - 320) / 525.0 + n[1] * (v - 240) / 525.0 + n[2]);
      // Half a pixel of rounding along the tilt: 2.5 m * 0.32 / 525 / 2; several source pixels on
      // one take the nearest, up to as much again; and a millimetre of depth.
      EXPECT_NEAR(registered[at(u, v)], 1e3 * z_m, 3.0) << u << ' ' << v;
    }
  }
  // The colour camera has fewer pixels for an angle than the depth camera: none stays empty but
  // where two cells of rounding part, on a tilt.
  EXPECT_GT(seen, 0.999 * 520 * 400);
}

// A near post in front of a wall: the two are seen with another parallax, the post hides the wall.
TEST(RegisterDepth, NearestWins) {
  const auto rig = kinect();
  std::vector<std::uint16_t> depth(640 * 480, 3000);
  for (int v = 0; v < 480; ++v) std::fill_n(depth.begin() + static_cast<long>(at(300, v)), 40, 800);
  const auto registered = register_depth(rig, depth);
  // x = (u - 320) / 585 * 0.8 - 0.025 for u = 300 and 339.
  const int left = static_cast<int>(std::lround(525.0 * (-20 / 585.0 - 0.025 / 0.8) + 320.0));
  const int right = static_cast<int>(std::lround(525.0 * (19 / 585.0 - 0.025 / 0.8) + 320.0));
  for (int u = left; u <= right; ++u) EXPECT_EQ(registered[at(u, 240)], 800) << u;
  EXPECT_NE(registered[at(left - 2, 240)], 800);
  EXPECT_NE(registered[at(right + 2, 240)], 800);
  // What the depth camera saw of neither post nor wall stays empty.
  EXPECT_GT(std::count(registered.begin(), registered.end(), 0), 0);
}

TEST(RegisterDepth, InvalidDepthStaysInvalid) {
  std::vector<std::uint16_t> depth(640 * 480, 0);
  depth[at(10, 10)] = 65535;
  const auto registered = register_depth(kinect(), depth);
  EXPECT_EQ(std::count(registered.begin(), registered.end(), 0), 640 * 480);
  EXPECT_THROW((void)register_depth(kinect(), std::vector<std::uint16_t>(10)), std::logic_error);
}

}  // namespace
}  // namespace camvox::import
