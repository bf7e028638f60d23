#include "camvox/simulation/texture.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace camvox::simulation {
namespace {

std::uint8_t to_byte(float value) {
  return static_cast<std::uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f);
}

/// The part after the point, for numbers that fit an int. std::floor is a library call on
/// processors without SSE 4.1, for which distributions build.
float fraction(float value) {
  const float part = value - static_cast<float>(static_cast<int>(value));
  return part < 0.0f ? part + 1.0f : part;
}

/// Halves an image, each texel the mean of four.
std::vector<Texel> reduce(const std::vector<Texel>& fine, std::size_t size) {
  const std::size_t half = size / 2;
  std::vector<Texel> coarse(half * half);
  for (std::size_t y = 0; y < half; ++y) {
    for (std::size_t x = 0; x < half; ++x) {
      const Texel* top = &fine[2 * y * size + 2 * x];
      coarse[y * half + x] = 0.25f * (top[0] + top[1] + top[size] + top[size + 1]);
    }
  }
  return coarse;
}

}  // namespace

Texture::Texture(int size_px, const std::vector<Texel>& texels) : size_px_(size_px) {
  std::size_t size = static_cast<std::size_t>(size_px);
  if (size_px < 1 || (size & (size - 1)) != 0 || texels.size() != size * size) {
    throw std::logic_error("Texture: the size must be a power of two and match the texels");
  }
  std::vector<Texel> level = texels;
  for (;; size /= 2) {
    std::vector<Bytes> bytes(level.size());
    std::transform(level.begin(), level.end(), bytes.begin(), [](const Texel& texel) {
      return Bytes{to_byte(texel[0]), to_byte(texel[1]), to_byte(texel[2]), to_byte(texel[3])};
    });
    levels_.push_back(std::move(bytes));
    if (size == 1) break;
    level = reduce(level, size);
  }
}

Texel Texture::sample(float u, float v, float footprint) const {
  const float top = static_cast<float>(levels_.size() - 1);
  const float lod =
      std::clamp(std::log2(std::max(footprint * static_cast<float>(size_px_), 1.0f)), 0.0f, top);
  const int level = static_cast<int>(lod);
  const float blend = lod - static_cast<float>(level);
  const Texel fine = bilinear(level, u, v);
  if (blend < 0.02f) return fine;
  return fine + blend * (bilinear(level + 1, u, v) - fine);
}

float Texture::sample_grey(float u, float v, float footprint) const {
  const float reduction = std::max(footprint * static_cast<float>(size_px_), 1.0f);
  const int top = static_cast<int>(levels_.size()) - 1;
  const int level = std::min(std::ilogb(reduction * 1.414f), top);
  const Taps taps = taps_at(level, u, v);
  const std::vector<Bytes>& texels = levels_[static_cast<std::size_t>(level)];
  const auto load = [&](std::size_t index) { return static_cast<float>(texels[index][0]); };
  const float upper = load(taps.index[0]) + taps.fx * (load(taps.index[1]) - load(taps.index[0]));
  const float lower = load(taps.index[2]) + taps.fx * (load(taps.index[3]) - load(taps.index[2]));
  return (upper + taps.fy * (lower - upper)) * (1.0f / 255.0f);
}

Texture::Taps Texture::taps_at(int level, float u, float v) const {
  const int size = size_px_ >> level;
  const float x = fraction(u) * static_cast<float>(size) - 0.5f;
  const float y = fraction(v) * static_cast<float>(size) - 0.5f;
  // Truncation of a number above zero is its floor.
  const int column = static_cast<int>(x + 1.0f) - 1;
  const int row = static_cast<int>(y + 1.0f) - 1;
  const int mask = size - 1;
  const auto x0 = static_cast<std::size_t>(column & mask);
  const auto x1 = static_cast<std::size_t>((column + 1) & mask);
  const auto row0 = static_cast<std::size_t>((row & mask) * size);
  const auto row1 = static_cast<std::size_t>(((row + 1) & mask) * size);
  return {{row0 + x0, row0 + x1, row1 + x0, row1 + x1},
          x - static_cast<float>(column),
          y - static_cast<float>(row)};
}

Texel Texture::bilinear(int level, float u, float v) const {
  const Taps taps = taps_at(level, u, v);
  const std::vector<Bytes>& texels = levels_[static_cast<std::size_t>(level)];
  const auto load = [&](std::size_t index) {
    const Bytes& b = texels[index];
    return Texel(b[0], b[1], b[2], b[3]);
  };
  const Texel upper = load(taps.index[0]) * (1.0f - taps.fx) + load(taps.index[1]) * taps.fx;
  const Texel lower = load(taps.index[2]) * (1.0f - taps.fx) + load(taps.index[3]) * taps.fx;
  return (upper * (1.0f - taps.fy) + lower * taps.fy) * (1.0f / 255.0f);
}

}  // namespace camvox::simulation
