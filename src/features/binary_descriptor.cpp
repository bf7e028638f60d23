#include "camvox/features/binary_descriptor.hpp"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

constexpr int kRadius = DescriptorExtractor::kPatch_px / 2;
constexpr int kStride = DescriptorExtractor::kStride_px;
constexpr int kReach = 3;  // of the 7x7 kernel
constexpr int kRows = DescriptorExtractor::kPatch_px + 2 * kReach;

/// exp(-i^2 / (2 sigma^2)) for sigma 2, i from 0 to 3, scaled to a sum of 256 over -3 to 3.
constexpr std::uint16_t kGauss[4] = {54, 49, 34, 18};

CAMVOX_ALWAYS_INLINE std::uint8_t smooth(const std::uint8_t* p, std::ptrdiff_t step) {
  const auto sum = static_cast<std::uint16_t>(kGauss[0] * p[0] + kGauss[1] * (p[-step] + p[step]) +
                                              kGauss[2] * (p[-2 * step] + p[2 * step]) +
                                              kGauss[3] * (p[-3 * step] + p[3 * step]) + 128);
  return static_cast<std::uint8_t>(sum >> 8);
}

}  // namespace

CAMVOX_TARGET_CLONES void smooth_patch(const ImageView& image,
                                       int u_px,
                                       int v_px,
                                       DescriptorExtractor::Patch& patch) {
  std::uint8_t rows[kRows][kStride];
  for (int r = 0; r < kRows; ++r) {
    const std::uint8_t* from = image.at(u_px - kRadius, v_px - kRadius - kReach + r);
    for (int i = 0; i < kStride; ++i) rows[r][i] = smooth(from + i, 1);
  }
  for (int r = 0; r < DescriptorExtractor::kPatch_px; ++r) {
    std::uint8_t* to = patch.data() + r * kStride;
    for (int i = 0; i < kStride; ++i) to[i] = smooth(&rows[r + kReach][i], kStride);
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
      return static_cast<std::uint16_t>(row * kStride + column);
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
    unsigned bits = 0;
    for (unsigned bit = 0; bit < 8; ++bit, offset += 2) {
      bits |= static_cast<unsigned>(patch[offset[0]] < patch[offset[1]]) << bit;
    }
    byte = static_cast<std::uint8_t>(bits);
  }
  return descriptor;
}

}  // namespace camvox::features
