#pragma once

#include <cmath>
#include <cstdint>

#include "camvox/simulation/random.hpp"

namespace camvox::simulation {

/// Value noise on the unit square that repeats at its borders; coordinates in [0, 2).
class TileNoise {
 public:
  explicit TileNoise(std::uint64_t seed) : key_(mix_bits(seed)) {}

  /// A number in [0, 1) that belongs to a lattice cell.
  [[nodiscard]] float cell(int x, int y, std::uint64_t channel = 0) const {
    const std::uint64_t place = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) |
                                static_cast<std::uint32_t>(y);
    const std::uint64_t bits = mix_bits((key_ ^ place) + channel * 0xd1342543de82ef95ULL);
    return static_cast<float>(bits >> 40) * 0x1.0p-24f;
  }

  /// Smooth noise in [0, 1) with `period_x` x `period_y` lattice cells over the unit square.
  [[nodiscard]] float smooth(float x, float y, int period_x, int period_y) const {
    const float px = x * static_cast<float>(period_x);
    const float py = y * static_cast<float>(period_y);
    const int ix = static_cast<int>(std::floor(px));
    const int iy = static_cast<int>(std::floor(py));
    const float fx = fade(px - static_cast<float>(ix));
    const float fy = fade(py - static_cast<float>(iy));
    const int x0 = wrap(ix, period_x);
    const int y0 = wrap(iy, period_y);
    const int x1 = wrap(x0 + 1, period_x);
    const int y1 = wrap(y0 + 1, period_y);
    const auto channel = static_cast<std::uint64_t>(period_x) << 8;
    const float upper = lerp(cell(x0, y0, channel), cell(x1, y0, channel), fx);
    const float lower = lerp(cell(x0, y1, channel), cell(x1, y1, channel), fx);
    return lerp(upper, lower, fy);
  }

  /// A sum of octaves from `period` on, each half as strong as the one before; mean 0.5.
  [[nodiscard]] float fractal(float x, float y, int period, int octaves) const {
    float sum = 0.0f;
    float weight = 0.5f;
    float total = 0.0f;
    for (int octave = 0; octave < octaves; ++octave) {
      sum += weight * smooth(x, y, period << octave, period << octave);
      total += weight;
      weight *= 0.6f;
    }
    return sum / total;
  }

 private:
  /// For 0 <= i < 2 period: coordinates never exceed two tiles.
  static int wrap(int i, int period) { return i < period ? i : i - period; }
  static float fade(float t) { return t * t * (3.0f - 2.0f * t); }
  static float lerp(float a, float b, float t) { return a + t * (b - a); }

  std::uint64_t key_;
};

}  // namespace camvox::simulation
