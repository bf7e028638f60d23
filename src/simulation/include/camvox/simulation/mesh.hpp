#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "camvox/simulation/texture.hpp"

namespace camvox::simulation {

/// How a surface looks to the camera and to the lidar.
struct Material {
  TextureKind texture = TextureKind::kPlaster;
  float tile_m = 4.0f;                           ///< Side of one texture tile.
  Eigen::Array3f tint = Eigen::Array3f::Ones();  ///< Multiplies the texture's colour.
  float blotches = 0.4f;                         ///< Strength of large-scale stains.
  float reflectivity = 0.4f;                     ///< Mean at 905 nm, 0 to 1.
  bool retroreflective = false;                  ///< Road signs, number plates.
  bool glows = false;                            ///< Lamps: not shaded.
};

/// Triangles with texture coordinates in metres on the surface. Normals follow from the geometry;
/// both sides of a triangle are visible.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<Eigen::Vector2f> uv_m;  ///< One per vertex.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint16_t> material_of;  ///< One per triangle: index of a Material.

  /// A parallelogram with corners p, p + a, p + a + b, p + b; texture starts at `uv`.
  void add_quad(const Eigen::Vector3f& p,
                const Eigen::Vector3f& a,
                const Eigen::Vector3f& b,
                int material,
                const Eigen::Vector2f& uv = Eigen::Vector2f::Zero());

  /// A quad that shows one cell (column, row) of a kWindows or kPosters texture whose tile has
  /// side `tile_m`.
  void add_cell_quad(const std::array<Eigen::Vector3f, 3>& p_a_b,
                     int material,
                     float tile_m,
                     int cell);

  /// A box: one corner and three edges that span it.
  void add_box(const Eigen::Vector3f& p,
               const std::array<Eigen::Vector3f, 3>& edges,
               int material,
               const Eigen::Vector2f& uv = Eigen::Vector2f::Zero());

  /// An axis-aligned box by its two extreme corners.
  void add_box(const Eigen::Vector3f& low, const Eigen::Vector3f& high, int material);

  /// A tube with `sides` flat faces from `bottom` to `top`, tapering, with a lid.
  void add_tube(const Eigen::Vector3f& bottom,
                const Eigen::Vector3f& top,
                const std::array<float, 2>& radii_m,
                int sides,
                int material);

  /// All of `other`, turned by `yaw_rad` around z, then moved by `offset`.
  void append(const Mesh& other, const Eigen::Vector3f& offset, float yaw_rad);

 private:
  void add_vertices(const std::array<Eigen::Vector3f, 4>& corners,
                    const std::array<Eigen::Vector2f, 4>& uv,
                    int material);
};

}  // namespace camvox::simulation
