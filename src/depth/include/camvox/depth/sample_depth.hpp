#pragma once

namespace camvox::depth {

/// A depth with its standard deviation; depth_m == 0 where there is none.
struct DepthSample {
  float depth_m = 0.0F;  ///< z along the optical axis.
  float sigma_m = 0.0F;
};

/// A depth image that somebody else keeps: rows from the top without padding, 0 = no depth.
struct DepthView {
  const float* depth_m = nullptr;
  const float* sigma_m = nullptr;  ///< Where depth_m is not 0: its standard deviation.
  int width_px = 0;
  int height_px = 0;
};

/// The depth of an image feature at a (raw, distorted, sub-pixel) location, from the pixels at
/// most `radius_px` (0 to 8) columns and rows away.
///
/// Corners gather at occlusion edges, where a corner belongs to the *nearer* surface (it is the
/// silhouette that is seen; the surface behind has no corner there). So: a window with one surface
/// gives the value of a plane (linear in inverse depth) through it; a window with several surfaces,
/// told apart by a gap in depth, gives that of the nearest one, also when the pixel itself lies on
/// the farther one or has no depth. Sigma holds the pixels' own, the spread about the plane, and
/// the slope over the way from the nearest pixel with depth. Nothing when no pixel has depth, or
/// when the nearest surface does not hold together. Does not read outside the image; NaN gives
/// nothing.
[[nodiscard]] DepthSample sample_depth(const DepthView& view,
                                       float u_px,
                                       float v_px,
                                       int radius_px);

}  // namespace camvox::depth
