#include "camvox/simulation/mesh.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace camvox::simulation {

using Eigen::Vector2f;
using Eigen::Vector3f;

void Mesh::add_vertices(const std::array<Vector3f, 4>& corners,
                        const std::array<Vector2f, 4>& uv,
                        int material) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  vertices.insert(vertices.end(), corners.begin(), corners.end());
  uv_m.insert(uv_m.end(), uv.begin(), uv.end());
  triangles.push_back({first, first + 1, first + 2});
  triangles.push_back({first, first + 2, first + 3});
  material_of.insert(material_of.end(), 2, static_cast<std::uint16_t>(material));
}

void Mesh::add_quad(
    const Vector3f& p, const Vector3f& a, const Vector3f& b, int material, const Vector2f& uv) {
  const Vector2f du(a.norm(), 0.0f);
  const Vector2f dv(0.0f, b.norm());
  add_vertices({p, p + a, p + a + b, p + b}, {uv, uv + du, uv + du + dv, uv + dv}, material);
}

void Mesh::add_cell_quad(const std::array<Vector3f, 3>& p_a_b,
                         int material,
                         float tile_m,
                         int cell) {
  const auto& [p, a, b] = p_a_b;
  const float side = tile_m / static_cast<float>(kTextureCells);
  const Vector2f uv(static_cast<float>(cell % kTextureCells) * side,
                    static_cast<float>(cell / kTextureCells % kTextureCells) * side);
  const Vector2f du(side, 0.0f);
  const Vector2f dv(0.0f, side);
  add_vertices({p, p + a, p + a + b, p + b}, {uv, uv + du, uv + du + dv, uv + dv}, material);
}

void Mesh::add_box(const Vector3f& p,
                   const std::array<Vector3f, 3>& edges,
                   int material,
                   const Vector2f& uv) {
  const auto& [a, b, c] = edges;
  add_quad(p, a, c, material, uv);
  add_quad(p + b, a, c, material, uv + Vector2f(0.7f, 0.3f));
  add_quad(p, b, c, material, uv + Vector2f(1.9f, 0.1f));
  add_quad(p + a, b, c, material, uv + Vector2f(3.1f, 0.9f));
  add_quad(p, a, b, material, uv + Vector2f(0.4f, 2.3f));
  add_quad(p + c, a, b, material, uv + Vector2f(1.3f, 3.7f));
}

void Mesh::add_box(const Vector3f& low, const Vector3f& high, int material) {
  const Vector3f size = high - low;
  add_box(low,
          {Vector3f(size.x(), 0, 0), Vector3f(0, size.y(), 0), Vector3f(0, 0, size.z())},
          material,
          {low.x() + low.y(), low.z()});
}

void Mesh::add_tube(const Vector3f& bottom,
                    const Vector3f& top,
                    const std::array<float, 2>& radii_m,
                    int sides,
                    int material) {
  const Vector3f axis = (top - bottom).normalized();
  const Vector3f x = axis.unitOrthogonal();
  const Vector3f y = axis.cross(x);
  const float length = (top - bottom).norm();
  const float turn = 2.0f * std::numbers::pi_v<float> / static_cast<float>(sides);
  for (int side = 0; side < sides; ++side) {
    const float angle0 = turn * static_cast<float>(side);
    const float angle1 = angle0 + turn;
    const Vector3f r0 = std::cos(angle0) * x + std::sin(angle0) * y;
    const Vector3f r1 = std::cos(angle1) * x + std::sin(angle1) * y;
    const float u0 = angle0 * radii_m[0];
    const float u1 = angle1 * radii_m[0];
    add_vertices({bottom + radii_m[0] * r0,
                  bottom + radii_m[0] * r1,
                  top + radii_m[1] * r1,
                  top + radii_m[1] * r0},
                 {Vector2f(u0, 0), Vector2f(u1, 0), Vector2f(u1, length), Vector2f(u0, length)},
                 material);
    add_vertices({top, top, top + radii_m[1] * r0, top + radii_m[1] * r1},
                 {Vector2f(0, 0), Vector2f(0, 0), Vector2f(u0, 0.1f), Vector2f(u1, 0.1f)},
                 material);
  }
}

void Mesh::append(const Mesh& other, const Vector3f& offset, float yaw_rad) {
  const auto first = static_cast<std::uint32_t>(vertices.size());
  const Eigen::Matrix3f R = Eigen::AngleAxisf(yaw_rad, Vector3f::UnitZ()).toRotationMatrix();
  for (const Vector3f& vertex : other.vertices) vertices.push_back(R * vertex + offset);
  uv_m.insert(uv_m.end(), other.uv_m.begin(), other.uv_m.end());
  for (const auto& [a, b, c] : other.triangles) {
    triangles.push_back({first + a, first + b, first + c});
  }
  material_of.insert(material_of.end(), other.material_of.begin(), other.material_of.end());
}

}  // namespace camvox::simulation
