#include <algorithm>

#include "palette.hpp"
#include "props.hpp"
#include "world_parts.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
namespace p = palette;

constexpr float kLength_m = 46.0f;
constexpr float kHalfWidth_m = 1.3f;
constexpr float kHeight_m = 2.8f;

/// Doors every few metres, and now and then a notice board or a fire extinguisher: few features,
/// much alike, which is what makes corridors hard.
void furnish_wall(float side, SequentialRandom& random, Mesh& mesh) {
  const float wall = side * kHalfWidth_m;
  const auto box = [&](const Vector2f& low, const Vector2f& high, float depth, int material) {
    const float inner = wall - side * depth;
    mesh.add_box(Vector3f(low.x(), std::min(wall, inner), low.y()),
                 Vector3f(high.x(), std::max(wall, inner), high.y()),
                 material);
  };
  for (float x = 3.0f + random.between(0.0f, 1.0f); x < kLength_m - 3.0f; x += 5.5f) {
    box({x, 0.0f}, {x + 1.0f, 2.1f}, 0.02f, p::kDoor);
    box({x - 0.08f, 0.0f}, {x, 2.18f}, 0.05f, p::kFrameDark);
    box({x + 1.0f, 0.0f}, {x + 1.08f, 2.18f}, 0.05f, p::kFrameDark);
    box({x - 0.08f, 2.1f}, {x + 1.08f, 2.18f}, 0.05f, p::kFrameDark);
    box({x + 0.85f, 1.0f}, {x + 0.95f, 1.08f}, 0.08f, p::kPole);
    mesh.add_cell_quad({Vector3f(x + 1.25f, wall - side * 0.012f, 1.5f),
                        Vector3f(0.22f, 0, 0),
                        Vector3f(0, 0, 0.16f)},
                       p::kPosters,
                       p::kPostersTile_m,
                       random.below(64));
    if (random.chance(0.3)) {
      mesh.add_cell_quad({Vector3f(x + 2.2f, wall - side * 0.02f, 1.1f),
                          Vector3f(1.4f, 0, 0),
                          Vector3f(0, 0, 0.9f)},
                         p::kPosters,
                         p::kPostersTile_m,
                         random.below(64));
    }
    if (random.chance(0.25)) box({x + 3.9f, 0.9f}, {x + 4.1f, 1.5f}, 0.15f, p::kCarRed);
  }
  box({0.0f, 0.0f}, {kLength_m, 0.1f}, 0.015f, p::kFrameDark);
}

}  // namespace

void build_corridor(SequentialRandom& random, World& world) {
  world.lighting.sun = 0.0f;
  world.lighting.ambient = 1.0f;
  world.lighting.sky = false;
  Mesh& mesh = world.scenery;
  const Vector3f along(kLength_m, 0, 0);
  const Vector3f across(0, 2 * kHalfWidth_m, 0);
  const Vector3f up(0, 0, kHeight_m);
  const Vector3f corner(0, -kHalfWidth_m, 0);
  mesh.add_quad(corner, along, across, p::kFloor);
  mesh.add_quad(corner + up, along, across, p::kCeiling);
  mesh.add_quad(corner, along, up, p::kCorridorWall, {0.3f, 0.0f});
  mesh.add_quad(corner + across, along, up, p::kCorridorWall, {31.7f, 0.0f});
  mesh.add_quad(corner, across, up, p::kCorridorWall, {7.0f, 0.0f});
  mesh.add_quad(corner + along, across, up, p::kCorridorWall, {13.0f, 0.0f});
  mesh.add_box(Vector3f(kLength_m - 0.03f, -0.9f, 0), Vector3f(kLength_m, 0.9f, 2.2f), p::kDoor);
  mesh.add_box(Vector3f(0, -0.9f, 0), Vector3f(0.03f, 0.9f, 2.2f), p::kDoor);
  furnish_wall(-1.0f, random, mesh);
  furnish_wall(1.0f, random, mesh);
  for (float x = 2.0f; x < kLength_m; x += 4.0f) {
    mesh.add_box(
        Vector3f(x, -0.15f, kHeight_m - 0.06f), Vector3f(x + 1.2f, 0.15f, kHeight_m), p::kLamp);
  }
}

}  // namespace camvox::simulation
