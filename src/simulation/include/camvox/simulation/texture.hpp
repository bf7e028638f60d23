#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace camvox::simulation {

/// What a surface is made of; each kind has one square texture that repeats without a seam.
enum class TextureKind : std::uint8_t {
  kBlotches,  ///< Soft fractal brightness, laid over the others at another scale.
  kAsphalt,
  kPaving,
  kBrick,
  kPlaster,
  kConcrete,
  kGrass,
  kFoliage,
  kBark,
  kPaint,
  kWindows,  ///< 8 x 8 cells, each the inside of another window.
  kPosters,  ///< 8 x 8 cells, each another sign or poster.
  kCloth,
  kFloorTiles,
  kClouds,
};
inline constexpr int kTextureKinds = 15;

/// Cells along each side of kWindows and kPosters.
inline constexpr int kTextureCells = 8;

/// Red, green, blue albedo and the lidar's reflectivity pattern, each 0 to 1. The last one is
/// correlated with the brightness, but has structure of its own, as near infrared has.
using Texel = Eigen::Array4f;

/// A repeating image with all its reductions (a mip pyramid), so that it can be looked up without
/// aliasing from any distance.
class Texture {
 public:
  /// `texels`: row by row, size_px * size_px; size_px a power of two.
  Texture(int size_px, const std::vector<Texel>& texels);

  /// The mean over about `footprint` (in tiles) around (u, v) (in tiles; repeats), trilinear.
  [[nodiscard]] Texel sample(float u, float v, float footprint) const;

  /// The first channel alone, without blending between reductions: for soft grey textures.
  [[nodiscard]] float sample_grey(float u, float v, float footprint) const;

  [[nodiscard]] int size_px() const { return size_px_; }

 private:
  using Bytes = std::array<std::uint8_t, 4>;
  /// The four texels around a place, and where it is between them.
  struct Taps {
    std::array<std::size_t, 4> index;
    float fx;
    float fy;
  };
  [[nodiscard]] Taps taps_at(int level, float u, float v) const;
  [[nodiscard]] Texel bilinear(int level, float u, float v) const;

  int size_px_;
  std::vector<std::vector<Bytes>> levels_;  ///< Finest first, the last is one texel.
};

/// Paints the texture of one kind from procedural noise.
[[nodiscard]] Texture make_texture(TextureKind kind, int size_px, std::uint64_t seed);

/// The textures of all kinds, in the order of the enumeration.
[[nodiscard]] std::vector<Texture> make_textures(std::uint64_t seed, int threads);

}  // namespace camvox::simulation
