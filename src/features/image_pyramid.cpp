#include "camvox/features/image_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "camvox/config/target_clones.hpp"

namespace camvox::features {
namespace {

// Vectors of 16 bytes: SSE and NEON registers. GCC and Clang turn the variable shuffle into pshufb
// or tbl where there is one.
using Bytes16 = std::uint8_t __attribute__((vector_size(16)));
using Words8 = std::uint16_t __attribute__((vector_size(16)));
using Bytes8 = std::uint8_t __attribute__((vector_size(8)));

constexpr int kOne = 128;           // fixed point of the weights
constexpr std::size_t kSlack = 64;  // bytes behind an image that vector code may read and write

/// to = (upper * (kOne - weight) + lower * weight) / kOne, rounded.
CAMVOX_TARGET_CLONES void blend_rows(const std::uint8_t* __restrict upper,
                                     const std::uint8_t* __restrict lower,
                                     int weight,
                                     int count,
                                     std::uint8_t* __restrict to) {
  const auto w_lower = static_cast<std::uint16_t>(weight);
  const auto w_upper = static_cast<std::uint16_t>(kOne - weight);
  for (int i = 0; i < count; ++i) {
    const auto sum = static_cast<std::uint16_t>(upper[i] * w_upper + lower[i] * w_lower + kOne / 2);
    to[i] = static_cast<std::uint8_t>(sum / kOne);
  }
}

}  // namespace

ImagePyramid::ImagePyramid(int levels, double scale_factor)
    : scale_factor_(scale_factor),
      views_(static_cast<std::size_t>(levels)),
      memory_(static_cast<std::size_t>(levels)),
      taps_(static_cast<std::size_t>(levels)) {
  double scale = 1.0;
  for (int level = 0; level < levels; ++level, scale *= scale_factor) scales_.push_back(scale);
}

void ImagePyramid::build(const ImageView& image) {
  views_[0] = image;
  for (std::size_t level = 1; level < views_.size(); ++level) shrink(views_[level - 1], level);
}

void ImagePyramid::make_taps(int from_width,
                             int width,
                             double scale_factor,
                             std::vector<Taps>& taps) {
  taps.assign(static_cast<std::size_t>((width + 7) / 8), Taps{});
  for (std::size_t block = 0; block < taps.size(); ++block) {
    Taps& tap = taps[block];
    for (int i = 0; i < 8; ++i) {
      const int u = std::min(8 * static_cast<int>(block) + i, width - 1);
      const double position = (u + 0.5) * scale_factor - 0.5;
      const int left = std::min(static_cast<int>(position), from_width - 2);
      if (i == 0) tap.source = std::max(0, std::min(left, from_width - 16));
      const auto place = static_cast<std::uint8_t>(left - tap.source);
      tap.bytes[2 * i] = place;
      tap.bytes[2 * i + 1] = static_cast<std::uint8_t>(place + 1);
      tap.weights[i] = static_cast<std::uint16_t>(std::lround((position - left) * kOne));
    }
  }
}

CAMVOX_TARGET_CLONES void ImagePyramid::shrink_row(const std::uint8_t* from,
                                                   const std::vector<Taps>& taps,
                                                   std::uint8_t* to) {
  for (const Taps& tap : taps) {
    Bytes16 source;
    Bytes16 places;
    Words8 weights;
    std::memcpy(&source, from + tap.source, sizeof source);
    std::memcpy(&places, tap.bytes, sizeof places);
    std::memcpy(&weights, tap.weights, sizeof weights);
    Words8 pairs;
    const Bytes16 shuffled = __builtin_shuffle(source, places);
    std::memcpy(&pairs, &shuffled, sizeof pairs);
    const Words8 first = pairs & 0xff;
    const Words8 second = pairs >> 8;
    const Words8 sum = (first * (kOne - weights) + second * weights + kOne / 2) >> 7;
    const Bytes8 bytes = __builtin_convertvector(sum, Bytes8);
    std::memcpy(to, &bytes, sizeof bytes);
    to += 8;
  }
}

void ImagePyramid::shrink(const ImageView& from, std::size_t level) {
  ImageView& view = views_[level];
  const int width = static_cast<int>(from.width_px / scale_factor_);
  const int height = static_cast<int>(from.height_px / scale_factor_);
  if (width < 16 || height < 2 || from.width_px < 16) {  // too small to hold a patch anyway
    view = {};
    return;
  }
  const auto step = static_cast<std::size_t>((width + 63) / 64 * 64);
  if (view.width_px != width || memory_[level].empty()) {
    make_taps(from.width_px, width, scale_factor_, taps_[level]);
  }
  memory_[level].resize(step * static_cast<std::size_t>(height) + kSlack);
  blended_row_.resize(static_cast<std::size_t>(from.width_px) + kSlack);
  view = {memory_[level].data(), width, height, static_cast<std::ptrdiff_t>(step)};
  for (int v = 0; v < height; ++v) {
    const double position = (v + 0.5) * scale_factor_ - 0.5;
    const int upper = std::min(static_cast<int>(position), from.height_px - 2);
    const int weight = static_cast<int>(std::lround((position - upper) * kOne));
    blend_rows(from.row(upper), from.row(upper + 1), weight, from.width_px, blended_row_.data());
    shrink_row(blended_row_.data(),
               taps_[level],
               memory_[level].data() + step * static_cast<std::size_t>(v));
  }
}

}  // namespace camvox::features
