#include "camvox/simulation/surface_shader.hpp"

#include <algorithm>

namespace camvox::simulation {

using Eigen::Array3f;
using Eigen::Vector2f;

SurfaceShader::SurfaceShader(std::uint64_t seed, int threads)
    : textures_(make_textures(seed, threads)) {
  for (const Texture& texture : textures_) {
    mean_reflectivity_.push_back(std::max(0.02f, texture.sample(0.5f, 0.5f, 1.0f)[3]));
  }
}

Array3f SurfaceShader::albedo(const Surface& surface, float footprint_m) const {
  const Material& material = *surface.material;
  const Vector2f uv = surface.uv_m / material.tile_m;
  Array3f color =
      material.tint *
      texture(material.texture).sample(uv.x(), uv.y(), footprint_m / material.tile_m).head<3>();
  if (material.blotches > 0.0f) {
    // Two more scales, incommensurate with the tile and turned, so that no patch of a large
    // surface looks like another.
    const Texture& blotches = texture(TextureKind::kBlotches);
    const Vector2f wide(0.83f * uv.x() + 0.56f * uv.y(), 0.83f * uv.y() - 0.56f * uv.x());
    const float coarse = blotches.sample_grey(
        0.137f * wide.x(), 0.137f * wide.y(), 0.137f * footprint_m / material.tile_m);
    const float medium = blotches.sample_grey(
        0.61f * wide.y(), 0.61f * wide.x(), 0.61f * footprint_m / material.tile_m);
    color *= std::max(
        0.15f,
        1.0f + material.blotches * (1.3f * (2.0f * coarse - 1.0f) + 1.3f * (2.0f * medium - 1.0f)));
  }
  return color;
}

float SurfaceShader::reflectivity(const Surface& surface, float footprint_m) const {
  const Material& material = *surface.material;
  const Vector2f uv = surface.uv_m / material.tile_m;
  const float pattern =
      texture(material.texture).sample(uv.x(), uv.y(), footprint_m / material.tile_m)[3];
  const float mean = mean_reflectivity_[static_cast<std::size_t>(material.texture)];
  return std::clamp(material.reflectivity * (0.25f + 0.75f * pattern / mean), 0.0f, 1.0f);
}

Array3f SurfaceShader::haze() { return {0.74f, 0.80f, 0.88f}; }

Array3f SurfaceShader::sky(const Eigen::Vector3f& direction_world) const {
  const float up = direction_world.z();
  if (up <= 0.0f) return haze();
  const Vector2f uv = direction_world.head<2>() / (up + 0.12f) * 0.11f;
  const Array3f clouds =
      texture(TextureKind::kClouds).sample(uv.x(), uv.y(), 0.0003f / (up + 0.05f)).head<3>();
  const float clear = std::min(1.0f, up / 0.35f);
  return haze() + clear * (1.15f * clouds - haze());
}

}  // namespace camvox::simulation
