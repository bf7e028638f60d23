#include "camvox/features/orientation.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

constexpr int kRadius = 15;
constexpr int kWidth = 32;  // columns -15 to 16; the last is never in the disc

/// For every row offset from 0: 0xff for the columns in the disc.
constexpr std::array<std::array<std::uint8_t, kWidth>, kRadius + 1> make_disc() {
  std::array<std::array<std::uint8_t, kWidth>, kRadius + 1> disc{};
  for (int v = 0; v <= kRadius; ++v) {
    for (int u = -kRadius; u <= kRadius; ++u) {
      // Half a pixel more than the radius: the digital disc.
      const bool inside = 4 * (u * u + v * v) <= (2 * kRadius + 1) * (2 * kRadius + 1);
      disc[static_cast<std::size_t>(v)][static_cast<std::size_t>(u + kRadius)] = inside ? 0xff : 0;
    }
  }
  return disc;
}

constexpr auto kDisc = make_disc();

}  // namespace

CAMVOX_TARGET_CLONES Moments patch_moments(const ImageView& image, int u_px, int v_px) {
  // Sums of a column stay in 16 bits: 31 * 255 and 120 * 255.
  std::int16_t sums[kWidth];
  std::int16_t weighted[kWidth];
  const std::uint8_t* centre = image.at(u_px - kRadius, v_px);
  for (int i = 0; i < kWidth; ++i) {
    sums[i] = static_cast<std::int16_t>(centre[i] & kDisc[0][static_cast<std::size_t>(i)]);
    weighted[i] = 0;
  }
  for (int v = 1; v <= kRadius; ++v) {
    const std::uint8_t* lower = centre + v * image.step_bytes;
    const std::uint8_t* upper = centre - v * image.step_bytes;
    const std::uint8_t* mask = kDisc[static_cast<std::size_t>(v)].data();
    for (int i = 0; i < kWidth; ++i) {
      const auto below = static_cast<std::int16_t>(lower[i] & mask[i]);
      const auto above = static_cast<std::int16_t>(upper[i] & mask[i]);
      sums[i] = static_cast<std::int16_t>(sums[i] + below + above);
      weighted[i] = static_cast<std::int16_t>(weighted[i] + v * (below - above));
    }
  }
  Moments moments;
  for (int i = 0; i < kWidth; ++i) {
    moments.m10 += (i - kRadius) * sums[i];
    moments.m01 += weighted[i];
  }
  return moments;
}

float orientation_rad(const ImageView& image, int u_px, int v_px) {
  const Moments moments = patch_moments(image, u_px, v_px);
  const float angle_rad =
      std::atan2(static_cast<float>(moments.m01), static_cast<float>(moments.m10));
  if (angle_rad >= 0.0F) return angle_rad;
  const float positive_rad = angle_rad + 2.0F * std::numbers::pi_v<float>;
  return positive_rad < 2.0F * std::numbers::pi_v<float> ? positive_rad : 0.0F;
}

}  // namespace camvox::features
