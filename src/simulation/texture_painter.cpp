#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "camvox/simulation/texture.hpp"
#include "parallel.hpp"
#include "tile_noise.hpp"

namespace camvox::simulation {
namespace {

using Rgb = Eigen::Array3f;

/// A place on the tile: coordinates in [0, 1), and the texel's own number for grain.
struct Spot {
  float x;
  float y;
  int column;
  int row;
};

using Painter = std::function<Rgb(const TileNoise&, const Spot&)>;

float grain(const TileNoise& noise, const Spot& spot, std::uint64_t channel = 1) {
  return noise.cell(spot.column, spot.row, channel) - 0.5f;
}

/// Thin dark lines where a smooth field crosses one half.
float cracks(const TileNoise& noise, const Spot& spot, int period, float width) {
  const float ridge = std::abs(noise.fractal(spot.x, spot.y, period, 4) - 0.5f);
  return ridge < width ? 1.0f : 0.0f;
}

/// A cell of a brick or tile bond, and whether the spot is in the joint around it.
struct Bond {
  int column;
  int row;
  bool joint;
};

Bond bond(const Spot& spot, int columns, int rows, float joint_fraction, bool staggered) {
  const float y = spot.y * static_cast<float>(rows);
  const int row = static_cast<int>(y);
  const float shift = staggered && row % 2 == 1 ? 0.5f : 0.0f;
  const float x = spot.x * static_cast<float>(columns) + shift;
  const float in_x = x - std::floor(x);
  const float in_y = y - std::floor(y);
  const float joint_y = joint_fraction * static_cast<float>(rows) / static_cast<float>(columns);
  return {static_cast<int>(x) % columns, row, in_x < joint_fraction || in_y < joint_y};
}

Rgb paint_blotches(const TileNoise& noise, const Spot& spot) {
  return Rgb::Constant(0.5f + 1.3f * (noise.fractal(spot.x, spot.y, 4, 7) - 0.5f));
}

Rgb paint_asphalt(const TileNoise& noise, const Spot& spot) {
  float value = 0.22f + 0.16f * (noise.fractal(spot.x, spot.y, 8, 6) - 0.5f);
  value += 0.14f * grain(noise, spot);
  // Stones of the aggregate, some of them nearly white.
  const float stone = noise.smooth(spot.x, spot.y, 170, 170);
  if (stone > 0.82f) value += 1.1f * (stone - 0.82f);
  if (stone < 0.14f) value -= 0.10f;
  if (cracks(noise, spot, 3, 0.004f) > 0.0f) value *= 0.35f;
  const float oil = noise.fractal(spot.x + 0.37f, spot.y + 0.11f, 5, 3);
  if (oil > 0.68f) value *= 0.6f;
  return value * Rgb(1.0f, 0.99f, 0.96f);
}

Rgb paint_paving(const TileNoise& noise, const Spot& spot) {
  const Bond stone = bond(spot, 10, 10, 0.035f, true);
  float value = 0.46f + 0.26f * (noise.cell(stone.column, stone.row, 9) - 0.5f);
  value += 0.16f * (noise.fractal(spot.x, spot.y, 16, 5) - 0.5f) + 0.10f * grain(noise, spot);
  if (noise.smooth(spot.x, spot.y, 140, 140) < 0.12f) value *= 0.7f;
  if (stone.joint) value = 0.18f + 0.08f * grain(noise, spot);
  const float warm = 0.06f * (noise.cell(stone.column, stone.row, 10) - 0.5f);
  return value * Rgb(1.0f + warm, 0.97f, 0.92f - warm);
}

Rgb paint_brick(const TileNoise& noise, const Spot& spot) {
  const Bond brick = bond(spot, 8, 24, 0.05f, true);
  const float tone = noise.cell(brick.column, brick.row, 4);
  const float rough = 0.25f * (noise.fractal(spot.x, spot.y, 32, 4) - 0.5f);
  Rgb color = Rgb(0.52f, 0.27f, 0.20f) * (0.65f + 0.7f * tone + rough);
  color += 0.08f * grain(noise, spot);
  if (noise.cell(brick.column, brick.row, 5) > 0.93f) color *= 0.45f;
  if (brick.joint) color = Rgb(0.60f, 0.58f, 0.54f) * (0.85f + rough);
  return color;
}

Rgb paint_plaster(const TileNoise& noise, const Spot& spot) {
  float value = 0.70f + 0.14f * (noise.fractal(spot.x, spot.y, 4, 7) - 0.5f);
  value += 0.06f * grain(noise, spot);
  // Rain streaks, long in the vertical.
  value -= 0.10f * std::max(0.0f, noise.smooth(spot.x, spot.y, 64, 3) - 0.55f);
  const float patch = noise.fractal(spot.x + 0.7f, spot.y + 0.2f, 6, 4);
  if (patch > 0.66f) value *= 0.86f;
  if (noise.smooth(spot.x, spot.y, 90, 90) > 0.93f) value *= 0.72f;
  if (cracks(noise, spot, 2, 0.0025f) > 0.0f) value *= 0.65f;
  return value * Rgb(1.0f, 0.98f, 0.94f);
}

Rgb paint_concrete(const TileNoise& noise, const Spot& spot) {
  const Bond panel = bond(spot, 2, 2, 0.006f, false);
  float value = 0.50f + 0.12f * (noise.cell(panel.column, panel.row, 3) - 0.5f);
  value += 0.22f * (noise.fractal(spot.x, spot.y, 6, 6) - 0.5f) + 0.05f * grain(noise, spot);
  value -= 0.25f * std::max(0.0f, noise.smooth(spot.x, spot.y, 40, 2) - 0.6f);
  // Holes of the form ties, four per panel.
  const float dx = std::abs(std::fmod(spot.x * 4.0f, 1.0f) - 0.5f);
  const float dy = std::abs(std::fmod(spot.y * 4.0f, 1.0f) - 0.5f);
  if (dx * dx + dy * dy < 0.0006f) value *= 0.3f;
  if (panel.joint) value *= 0.4f;
  if (noise.smooth(spot.x, spot.y, 120, 120) > 0.94f) value *= 0.6f;
  return value * Rgb(0.98f, 0.99f, 1.0f);
}

Rgb paint_grass(const TileNoise& noise, const Spot& spot) {
  const float blade = noise.smooth(spot.x, spot.y, 300, 120);
  const float patch = noise.fractal(spot.x, spot.y, 5, 6);
  const float value = 0.35f + 0.7f * (blade - 0.5f) * 0.6f + 0.8f * (patch - 0.5f);
  const Rgb color = Rgb(0.30f, 0.42f, 0.16f) * (0.4f + 1.4f * std::max(0.0f, value));
  const bool flower = noise.smooth(spot.x, spot.y, 210, 210) > 0.955f;
  return flower ? Rgb(0.8f, 0.78f, 0.5f) : Rgb(color + 0.06f * grain(noise, spot));
}

Rgb paint_foliage(const TileNoise& noise, const Spot& spot) {
  const float leaf = noise.smooth(spot.x, spot.y, 90, 90);
  const float clump = noise.fractal(spot.x, spot.y, 8, 5);
  const Rgb color = Rgb(0.25f, 0.40f, 0.13f) * (0.25f + 1.0f * leaf + 1.2f * (clump - 0.3f));
  return leaf < 0.2f ? Rgb(color * 0.4f) : color;
}

Rgb paint_bark(const TileNoise& noise, const Spot& spot) {
  const float groove = noise.smooth(spot.x, spot.y, 60, 12);
  const float rough = noise.fractal(spot.x, spot.y, 12, 5);
  return Rgb(0.34f, 0.26f, 0.20f) * (0.3f + groove + 0.6f * (rough - 0.3f));
}

Rgb paint_paint(const TileNoise& noise, const Spot& spot) {
  float value = 0.78f + 0.10f * (noise.fractal(spot.x, spot.y, 3, 6) - 0.5f);
  if (noise.smooth(spot.x, spot.y, 64, 64) > 0.96f) value *= 0.75f;
  return Rgb::Constant(value + 0.02f * grain(noise, spot));
}

/// Position of a spot inside its cell of an 8 x 8 texture.
struct Cell {
  int column;
  int row;
  float x;
  float y;
};

Cell cell_of(const Spot& spot) {
  const float x = spot.x * static_cast<float>(kTextureCells);
  const float y = spot.y * static_cast<float>(kTextureCells);
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  return {column, row, x - static_cast<float>(column), y - static_cast<float>(row)};
}

Rgb paint_windows(const TileNoise& noise, const Spot& spot) {
  const Cell cell = cell_of(spot);
  const auto pick = [&](std::uint64_t channel) {
    return noise.cell(cell.column, cell.row, channel);
  };
  // A dark room with the brighter sky mirrored in the upper part.
  Rgb color = Rgb(0.10f, 0.12f, 0.14f) * (0.6f + 0.8f * pick(20));
  const float skyline = 0.35f + 0.4f * noise.smooth(cell.x * 0.12f + pick(21), 0.0f, 40, 1);
  if (cell.y > skyline) color += Rgb(0.16f, 0.20f, 0.25f) * pick(22);
  const float curtain = 0.45f * pick(23);
  if (pick(24) > 0.4f && (cell.x < curtain || cell.x > 1.0f - curtain)) {
    const float fold = 0.5f + 0.5f * std::sin(cell.x * (60.0f + 40.0f * pick(25)));
    color = Rgb(0.62f, 0.58f, 0.50f) * (0.55f + 0.45f * fold);
  }
  const float blind = 1.0f - 0.9f * pick(26);
  if (pick(27) > 0.6f && cell.y > blind) {
    color = Rgb::Constant(0.55f * (std::fmod(cell.y * 24.0f, 1.0f) < 0.75f ? 1.0f : 0.5f));
  }
  if (std::abs(cell.x - 0.5f) < 0.025f || std::abs(cell.y - 0.62f) < 0.018f) {
    color = Rgb::Constant(0.70f);
  }
  return color + 0.03f * (noise.fractal(spot.x, spot.y, 64, 3) - 0.5f);
}

Rgb random_color(const TileNoise& noise, const Cell& cell, std::uint64_t channel) {
  return {noise.cell(cell.column, cell.row, channel),
          noise.cell(cell.column, cell.row, channel + 1),
          noise.cell(cell.column, cell.row, channel + 2)};
}

/// Lines of letters: a bitmap of 4 x 5 random dots per letter.
bool is_ink(const TileNoise& noise, const Cell& cell, float top, float height, int letters) {
  const float line = (cell.y - top) / height;
  if (line < 0.0f || line >= 1.0f || cell.x < 0.08f || cell.x > 0.92f) return false;
  const float along = (cell.x - 0.08f) / 0.84f * static_cast<float>(letters);
  const int letter = static_cast<int>(along);
  const int dot_x = static_cast<int>((along - static_cast<float>(letter)) * 5.0f);
  const int dot_y = static_cast<int>(line * 5.0f);
  if (dot_x == 4) return false;
  const auto channel = static_cast<std::uint64_t>(1000 + letter * 32 + dot_y * 4 + dot_x) +
                       static_cast<std::uint64_t>(top * 64.0f) * 4096;
  return noise.cell(cell.column, cell.row, channel) > 0.42f;
}

Rgb paint_posters(const TileNoise& noise, const Spot& spot) {
  const Cell cell = cell_of(spot);
  Rgb color = 0.25f + 0.6f * random_color(noise, cell, 40);
  for (std::uint64_t shape = 0; shape < 7; ++shape) {
    const std::uint64_t base = 60 + 10 * shape;
    const float dx = cell.x - noise.cell(cell.column, cell.row, base);
    const float dy = cell.y - noise.cell(cell.column, cell.row, base + 1);
    const float size_x = 0.05f + 0.25f * noise.cell(cell.column, cell.row, base + 2);
    const float size_y = 0.05f + 0.20f * noise.cell(cell.column, cell.row, base + 3);
    const bool round = noise.cell(cell.column, cell.row, base + 4) > 0.5f;
    const bool inside = round ? dx * dx + dy * dy < size_x * size_x * 0.5f
                              : std::abs(dx) < size_x && std::abs(dy) < size_y;
    if (inside) color = 0.05f + 0.9f * random_color(noise, cell, base + 5);
  }
  if (is_ink(noise, cell, 0.72f, 0.16f, 7) || is_ink(noise, cell, 0.14f, 0.07f, 15) ||
      is_ink(noise, cell, 0.05f, 0.06f, 17)) {
    color = color.mean() > 0.45f ? Rgb::Constant(0.05f) : Rgb::Constant(0.92f);
  }
  const bool border = std::min({cell.x, cell.y, 1.0f - cell.x, 1.0f - cell.y}) < 0.03f;
  return border ? Rgb(Rgb::Constant(0.8f)) : Rgb(color + 0.03f * grain(noise, spot));
}

Rgb paint_cloth(const TileNoise& noise, const Spot& spot) {
  const float stripe = noise.cell(static_cast<int>(spot.y * 24.0f), 0, 5);
  const float weave = noise.fractal(spot.x, spot.y, 16, 5);
  return Rgb::Constant(0.35f + 0.4f * stripe + 0.5f * (weave - 0.5f));
}

Rgb paint_floor_tiles(const TileNoise& noise, const Spot& spot) {
  const Bond tile = bond(spot, 4, 4, 0.012f, false);
  float value = 0.56f + 0.06f * (noise.cell(tile.column, tile.row, 2) - 0.5f);
  value += 0.10f * (noise.fractal(spot.x, spot.y, 8, 6) - 0.5f) + 0.03f * grain(noise, spot);
  if (noise.smooth(spot.x, spot.y, 128, 128) > 0.93f) value *= 0.78f;
  if (tile.joint) value *= 0.55f;
  return value * Rgb(1.0f, 0.98f, 0.93f);
}

Rgb paint_clouds(const TileNoise& noise, const Spot& spot) {
  const float density = noise.fractal(spot.x, spot.y, 3, 7);
  const float cloud = std::clamp((density - 0.47f) * 4.0f, 0.0f, 1.0f);
  return Rgb(0.46f, 0.60f, 0.82f) * (1.0f - cloud) + Rgb(0.93f, 0.94f, 0.96f) * cloud;
}

Painter painter_of(TextureKind kind) {
  switch (kind) {
    case TextureKind::kBlotches:
      return paint_blotches;
    case TextureKind::kAsphalt:
      return paint_asphalt;
    case TextureKind::kPaving:
      return paint_paving;
    case TextureKind::kBrick:
      return paint_brick;
    case TextureKind::kPlaster:
      return paint_plaster;
    case TextureKind::kConcrete:
      return paint_concrete;
    case TextureKind::kGrass:
      return paint_grass;
    case TextureKind::kFoliage:
      return paint_foliage;
    case TextureKind::kBark:
      return paint_bark;
    case TextureKind::kPaint:
      return paint_paint;
    case TextureKind::kWindows:
      return paint_windows;
    case TextureKind::kPosters:
      return paint_posters;
    case TextureKind::kCloth:
      return paint_cloth;
    case TextureKind::kFloorTiles:
      return paint_floor_tiles;
    case TextureKind::kClouds:
      return paint_clouds;
  }
  return paint_blotches;
}

}  // namespace

Texture make_texture(TextureKind kind, int size_px, std::uint64_t seed) {
  const TileNoise noise(mix_bits(seed) + static_cast<std::uint64_t>(kind));
  const TileNoise infrared(mix_bits(seed + 77) + static_cast<std::uint64_t>(kind));
  const Painter paint = painter_of(kind);
  const float step = 1.0f / static_cast<float>(size_px);
  std::vector<Texel> texels;
  texels.reserve(static_cast<std::size_t>(size_px) * static_cast<std::size_t>(size_px));
  for (int row = 0; row < size_px; ++row) {
    for (int column = 0; column < size_px; ++column) {
      const Spot spot{(static_cast<float>(column) + 0.5f) * step,
                      (static_cast<float>(row) + 0.5f) * step,
                      column,
                      row};
      const Rgb color = paint(noise, spot).max(0.0f).min(1.0f);
      const float own = infrared.fractal(spot.x, spot.y, 7, 4);
      Texel texel;
      texel << color, 0.6f * color.mean() + 0.4f * own;
      texels.push_back(texel);
    }
  }
  return {size_px, texels};
}

std::vector<Texture> make_textures(std::uint64_t seed, int threads) {
  std::vector<std::optional<Texture>> painted(kTextureKinds);
  parallel_for(kTextureKinds, threads, [&](int i) {
    const auto kind = static_cast<TextureKind>(i);
    const bool coarse = kind == TextureKind::kPaint || kind == TextureKind::kBark ||
                        kind == TextureKind::kCloth || kind == TextureKind::kClouds ||
                        kind == TextureKind::kBlotches || kind == TextureKind::kFoliage ||
                        kind == TextureKind::kPlaster || kind == TextureKind::kConcrete;
    painted[static_cast<std::size_t>(i)] = make_texture(kind, coarse ? 512 : 1024, seed);
  });
  std::vector<Texture> textures;
  for (auto& texture : painted) textures.push_back(std::move(*texture));
  return textures;
}

}  // namespace camvox::simulation
