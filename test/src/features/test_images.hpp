#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "camvox/features/image_view.hpp"

namespace camvox::features {

/// An image that owns its pixels, with rows longer than the width.
struct TestImage {
  int width_px;
  int height_px;
  std::vector<std::uint8_t> pixels;

  TestImage(int width, int height, const std::function<int(int u, int v)>& grey)
      : width_px(width), height_px(height) {
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < step(); ++u) {
        pixels.push_back(u < width ? static_cast<std::uint8_t>(std::clamp(grey(u, v), 0, 255))
                                   : 77);
      }
    }
  }
  [[nodiscard]] int step() const { return width_px + 5; }
  [[nodiscard]] ImageView view() const { return {pixels.data(), width_px, height_px, step()}; }
  [[nodiscard]] int at(int u, int v) const {
    return pixels[static_cast<std::size_t>(v * step() + u)];
  }
};

inline TestImage flat_image(int width, int height, int grey = 0) {
  return {width, height, [grey](int, int) { return grey; }};
}

inline TestImage noise_image(int width, int height, unsigned seed, double sigma = 60.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(128.0, sigma);
  return {width, height, [&](int, int) { return static_cast<int>(noise(random)); }};
}

/// Overlapping rectangles of random grey on a slope, with a little noise: edges, corners and
/// nearly flat areas.
inline TestImage block_image(int width, int height, unsigned seed) {
  struct Block {
    int u, v, width, height, grey;
  };
  std::mt19937 random(seed);
  const auto draw = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  std::vector<Block> blocks;
  for (int i = 0; i < width * height / 900; ++i) {
    blocks.push_back(
        {draw(-20, width), draw(-20, height / 2), draw(4, 40), draw(4, 40), draw(0, 255)});
  }
  return {width, height, [&](int u, int v) {
            int grey = (u + v) / 8 % 256;
            for (const Block& b : blocks) {
              const bool inside = u >= b.u && u < b.u + b.width && v >= b.v && v < b.v + b.height;
              if (inside) grey = b.grey;
            }
            return grey + draw(-4, 4);
          }};
}

/// Images of many sizes and kinds, some too small for any feature.
inline std::vector<TestImage> test_images() {
  return {noise_image(160, 121, 1),
          noise_image(101, 73, 2, 12.0),
          block_image(333, 211, 3),
          block_image(170, 240, 4),
          noise_image(40, 41, 5),
          noise_image(39, 39, 6),
          noise_image(38, 60, 7),
          noise_image(17, 3, 8),
          noise_image(1, 1, 9),
          flat_image(120, 90),
          flat_image(120, 90, 255)};
}

}  // namespace camvox::features
