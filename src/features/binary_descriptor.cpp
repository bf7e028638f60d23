#include "camvox/features/binary_descriptor.hpp"

#include <cmath>
#include <cstddef>
#include <cstring>
#include <numbers>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

constexpr int kRadius = DescriptorExtractor::kPatch_px / 2;
constexpr int kStride = DescriptorExtractor::kStride_px;
constexpr int kReach = 3;  // of the 7x7 kernel
constexpr int kRows = DescriptorExtractor::kPatch_px + 2 * kReach;

using Words16 = std::uint16_t __attribute__((vector_size(32)));

/// Every second of 32 bytes, from the first.
CAMVOX_ALWAYS_INLINE Words16 even_bytes(const std::uint8_t* p) {
  Words16 words;
  std::memcpy(&words, p, sizeof words);
  return words & 0xff;
}

/// Sums of seven neighbours in a row with weights 1 2 3 3 3 2 1 (a box of 3 over a box of 5), for
/// 32 places that start 3 px right of `p`: the even places, then the odd ones.
CAMVOX_ALWAYS_INLINE void sum_row(const std::uint8_t* p, Words16* even, Words16* odd) {
  Words16 e[8];
  for (int i = 0; i < 8; ++i) e[i] = even_bytes(p + i);
  const Words16 pair1 = e[1] + e[2];
  const Words16 pair3 = e[3] + e[4];
  const Words16 pair5 = e[5] + e[6];
  const Words16 inner = (pair1 + e[3]) + (e[2] + pair3) + (pair3 + e[5]) + (e[4] + pair5);
  *even = inner + (e[0] + pair1);
  *odd = inner + (pair5 + e[7]);
}

}  // namespace

CAMVOX_TARGET_CLONES void smooth_patch(const ImageView& image,
                                       int u_px,
                                       int v_px,
                                       DescriptorExtractor::Patch& patch) {
  Words16 rows[kRows][2];
  const std::uint8_t* from = image.at(u_px - kRadius - kReach, v_px - kRadius - kReach);
  for (int r = 0; r < kRows; ++r, from += image.step_bytes) sum_row(from, &rows[r][0], &rows[r][1]);
  for (int half = 0; half < 2; ++half) {
    Words16 boxes[kRows - 2];
    for (int r = 0; r < kRows - 2; ++r)
      boxes[r] = rows[r][half] + rows[r + 1][half] + rows[r + 2][half];
    for (int r = 0; r < DescriptorExtractor::kPatch_px; ++r) {
      const Words16 sum = boxes[r] + boxes[r + 1] + boxes[r + 2] + boxes[r + 3] + boxes[r + 4];
      std::memcpy(patch.data() + r * kStride + half * kStride / 2, &sum, sizeof sum);
    }
  }
}

DescriptorExtractor::DescriptorExtractor() : offsets_(kAngles) {
  for (int angle = 0; angle < kAngles; ++angle) {
    const double angle_rad = 2.0 * std::numbers::pi * angle / kAngles;
    const double c = std::cos(angle_rad);
    const double s = std::sin(angle_rad);
    const auto place = [&](int du, int dv) {
      const long column = std::lround(c * du - s * dv) + kRadius;
      const long row = std::lround(s * du + c * dv) + kRadius;
      return static_cast<std::uint16_t>(
          DescriptorExtractor::place(static_cast<int>(column), static_cast<int>(row)));
    };
    Offsets& offsets = offsets_[static_cast<std::size_t>(angle)];
    std::size_t next = 0;
    for (const PixelPair& pair : sampling_pattern()) {
      offsets[next++] = place(pair.du_a, pair.dv_a);
      offsets[next++] = place(pair.du_b, pair.dv_b);
    }
  }
}

int DescriptorExtractor::angle_index(float angle_rad) {
  constexpr float kPerRadian = kAngles / (2.0F * std::numbers::pi_v<float>);
  return static_cast<int>(angle_rad * kPerRadian + 0.5F) % kAngles;
}

Descriptor DescriptorExtractor::describe(const ImageView& image,
                                         int u_px,
                                         int v_px,
                                         float angle_rad) const {
  Patch patch;
  smooth_patch(image, u_px, v_px, patch);
  const std::uint16_t* offset = offsets_[static_cast<std::size_t>(angle_index(angle_rad))].data();
  Descriptor descriptor;
  for (std::uint8_t& byte : descriptor.bytes) {
    unsigned bits = 0;  // the last pair first: each makes room for the next with one addition
    for (int pair = 7; pair >= 0; --pair) {
      bits += bits + static_cast<unsigned>(patch[offset[2 * pair]] < patch[offset[2 * pair + 1]]);
    }
    byte = static_cast<std::uint8_t>(bits);
    offset += 16;
  }
  return descriptor;
}

}  // namespace camvox::features
