#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "camvox/features/feature.hpp"
#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// One bit of a descriptor: is the pixel at the first offset darker than that at the second?
struct PixelPair {
  std::int8_t du_a, dv_a, du_b, dv_b;
};

/// The 256 pairs, within 15 px of the centre. Ours: drawn at random from a Gaussian and chosen
/// greedily for wide, hardly correlated differences (see sampling_pattern.cpp).
[[nodiscard]] const std::array<PixelPair, 256>& sampling_pattern();

/// Describes patches by 256 comparisons of smoothed pixels, turned with the key point's orientation
/// (BRIEF: Calonder et al., ECCV 2010; turned: Rublee et al., ICCV 2011). The turned
/// patterns are prepared for kAngles directions.
class DescriptorExtractor {
 public:
  static constexpr int kAngles = 128;
  static constexpr int kPatch_px = 31;   ///< Side of the smoothed patch.
  static constexpr int kStride_px = 32;  ///< From row to row of the smoothed patch.
  using Patch = std::array<std::uint16_t, kPatch_px * kStride_px>;
  /// Where a patch keeps the pixel of a column and row: even columns first, then odd ones.
  [[nodiscard]] static constexpr int place(int column, int row) {
    return row * kStride_px + column % 2 * (kStride_px / 2) + column / 2;
  }

  DescriptorExtractor();

  /// The pixel must be at least 19 px away from the image's edge.
  [[nodiscard]] Descriptor describe(const ImageView& image,
                                    int u_px,
                                    int v_px,
                                    float angle_rad) const;

  /// The prepared direction nearest to an angle.
  [[nodiscard]] static int angle_index(float angle_rad);

 private:
  /// Places of the 256 pairs in a Patch.
  using Offsets = std::array<std::uint16_t, 512>;

  std::vector<Offsets> offsets_;
};

/// Smooths the pixels around a key point by 7x7 weights (1 2 3 3 3 2 1 in both directions), which
/// are those of a Gaussian of sigma 2 px to within a tenth; the sums of 225 are not divided.
void smooth_patch(const ImageView& image, int u_px, int v_px, DescriptorExtractor::Patch& patch);

}  // namespace camvox::features
