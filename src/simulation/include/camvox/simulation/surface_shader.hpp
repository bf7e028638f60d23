#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "camvox/simulation/ray_scene.hpp"
#include "camvox/simulation/texture.hpp"

namespace camvox::simulation {

/// What surfaces look like: colour for the camera, reflectivity for the lidar, and the sky.
/// Immutable, so safe to use from many threads.
class SurfaceShader {
 public:
  /// Paints the textures of `seed` on `threads` threads.
  SurfaceShader(std::uint64_t seed, int threads);

  /// Albedo (linear red, green, blue) of a surface, averaged over a disc of `footprint_m`.
  [[nodiscard]] Eigen::Array3f albedo(const Surface& surface, float footprint_m) const;

  /// Reflectivity at 905 nm, 0 to 1: the material's mean times a pattern of its own.
  [[nodiscard]] float reflectivity(const Surface& surface, float footprint_m) const;

  /// Radiance of the sky in a direction (unit vector): clouds above, haze at the horizon.
  [[nodiscard]] Eigen::Array3f sky(const Eigen::Vector3f& direction_world) const;

  /// Radiance of the air in front of far things.
  [[nodiscard]] static Eigen::Array3f haze();

 private:
  [[nodiscard]] const Texture& texture(TextureKind kind) const {
    return textures_[static_cast<std::size_t>(kind)];
  }

  std::vector<Texture> textures_;
  std::vector<float> mean_reflectivity_;  ///< Of the texture patterns, to divide by.
};

}  // namespace camvox::simulation
