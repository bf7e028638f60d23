#pragma once

#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// The direction from a pixel to the centroid of the intensities in a disc of radius 15 px
/// around it, in [0, 2 pi) (Rublee et al., ICCV 2011, section 3.2). The pixel must be at least
/// 15 px away from the image's edge. Flat patches give 0.
[[nodiscard]] float orientation_rad(const ImageView& image, int u_px, int v_px);

/// First moments of the intensities in that disc.
struct Moments {
  int m10 = 0;  ///< Sum of column offset times intensity.
  int m01 = 0;  ///< Sum of row offset times intensity.
};
[[nodiscard]] Moments patch_moments(const ImageView& image, int u_px, int v_px);

}  // namespace camvox::features
