#include "props.hpp"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "palette.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector3f;
namespace p = palette;

Vector3f random_direction(SequentialRandom& random) {
  const float z = random.between(-1.0f, 1.0f);
  const float angle = random.between(0.0f, 2.0f * std::numbers::pi_v<float>);
  const float r = std::sqrt(1.0f - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Leaves as small squares in an ellipsoid, denser towards its skin.
void add_leaves(const Vector3f& centre,
                const Vector3f& radii,
                int count,
                SequentialRandom& random,
                Mesh& mesh) {
  const int first = p::kLeafDark + random.below(2);
  for (int i = 0; i < count; ++i) {
    const float depth = std::sqrt(random.between(0.15f, 1.0f));
    const Vector3f place = centre + depth * random_direction(random).cwiseProduct(radii);
    const Vector3f a = random_direction(random);
    const Vector3f b = a.unitOrthogonal();
    const float size = random.between(0.08f, 0.24f);
    const int material =
        random.chance(0.08) ? p::kLeafYellow : first + (random.chance(0.3) ? 1 : 0);
    mesh.add_quad(place,
                  size * a,
                  0.7f * size * b,
                  material > p::kLeafYellow ? p::kLeafLight : material,
                  {random.between(0.0f, 1.5f), random.between(0.0f, 1.5f)});
  }
}

void add_wheel(float x, float y, Mesh& mesh) {
  mesh.add_tube({x, y - 0.1f, 0.31f}, {x, y + 0.1f, 0.31f}, {0.31f, 0.31f}, 14, p::kRubber);
  const float side = y > 0.0f ? 0.101f : -0.101f;
  mesh.add_tube(
      {x, y, 0.31f}, {x, y + side + (y > 0 ? 0.01f : -0.01f), 0.31f}, {0.17f, 0.17f}, 8, p::kPole);
}

/// The cabin of a car: a box whose upper part is narrower, in glass, under a painted roof.
void add_cabin(float rear, float front, int paint, Mesh& mesh) {
  const float z0 = 0.86f;
  const float z1 = 1.42f;
  const float y0 = 0.80f;
  const float y1 = 0.62f;
  const float slope = 0.45f;
  const Vector3f rise_left(slope * 0.3f, y0 - y1, z1 - z0);
  mesh.add_quad(
      {rear + slope * 0.5f, -y1, z1}, {front - rear - 1.4f * slope, 0, 0}, {0, 2 * y1, 0}, paint);
  const Vector3f along(front - rear, 0, 0);
  mesh.add_quad({rear, -y0, z0}, along * 0.9f, {slope * 0.45f, y0 - y1, z1 - z0}, p::kCarGlass);
  mesh.add_quad({rear, y0, z0}, along * 0.9f, {slope * 0.45f, y1 - y0, z1 - z0}, p::kCarGlass);
  mesh.add_quad({rear, -y1, z0}, {slope * 0.5f, 0, z1 - z0}, {0, 2 * y1, 0}, p::kCarGlass);
  mesh.add_quad({front, -y1, z0}, {-slope * 1.1f, 0, z1 - z0}, {0, 2 * y1, 0}, p::kCarGlass);
  const float pillar = 0.5f * (rear + front);
  for (const float x : {rear + 0.1f, pillar, front - 0.35f}) {
    mesh.add_quad({x, -y0 - 0.005f, z0}, {0.09f, 0, 0}, rise_left, paint);
    mesh.add_quad(
        {x, y0 + 0.005f, z0}, {0.09f, 0, 0}, {rise_left.x(), -rise_left.y(), rise_left.z()}, paint);
  }
}

}  // namespace

Mesh make_tree(SequentialRandom& random) {
  Mesh mesh;
  const float height = random.between(5.0f, 9.0f);
  const float crown = random.between(1.6f, 2.8f);
  const float radius = random.between(0.12f, 0.24f);
  const Vector3f fork(random.between(-0.3f, 0.3f), random.between(-0.3f, 0.3f), 0.45f * height);
  mesh.add_tube({0, 0, 0}, fork, {radius, 0.7f * radius}, 9, p::kBark);
  const Vector3f centre(fork.x(), fork.y(), height - 0.9f * crown);
  for (int i = 0; i < 6; ++i) {
    const Vector3f tip = centre + 0.8f * crown * random_direction(random);
    mesh.add_tube(fork, tip, {0.5f * radius, 0.15f * radius}, 5, p::kBark);
  }
  for (int blob = 0; blob < 5; ++blob) {
    const Vector3f offset = 0.55f * crown * random_direction(random);
    const Vector3f radii = Vector3f(0.7f, 0.7f, 0.6f) * crown;
    add_leaves(centre + offset, radii, 420, random, mesh);
  }
  return mesh;
}

Mesh make_bush(SequentialRandom& random) {
  Mesh mesh;
  const float size = random.between(0.5f, 1.0f);
  add_leaves({0, 0, 0.6f * size}, Vector3f(1.1f, 1.1f, 0.7f) * size, 350, random, mesh);
  return mesh;
}

Mesh make_car(SequentialRandom& random) {
  Mesh mesh;
  const int paint = p::kCarWhite + random.below(5);
  const float half = random.between(2.0f, 2.3f);
  const bool van = random.chance(0.2);
  mesh.add_box(Vector3f(-half, -0.86f, 0.28f), Vector3f(half, 0.86f, 0.62f), paint);
  mesh.add_box(Vector3f(-half + 0.08f, -0.83f, 0.62f), Vector3f(half - 0.1f, 0.83f, 0.87f), paint);
  mesh.add_box(Vector3f(-half - 0.05f, -0.8f, 0.3f), Vector3f(-half, 0.8f, 0.5f), p::kFrameDark);
  mesh.add_box(Vector3f(half, -0.8f, 0.3f), Vector3f(half + 0.05f, 0.8f, 0.5f), p::kFrameDark);
  if (van) {
    mesh.add_box(
        Vector3f(-half + 0.08f, -0.82f, 0.87f), Vector3f(half - 1.3f, 0.82f, 1.95f), paint);
    mesh.add_quad({half - 1.29f, -0.75f, 1.0f}, {0, 1.5f, 0}, {-0.05f, 0, 0.8f}, p::kCarGlass);
  } else {
    add_cabin(-half + 0.35f, half - 1.1f, paint, mesh);
  }
  for (const float x : {-half + 0.75f, half - 0.85f}) {
    add_wheel(x, -0.80f, mesh);
    add_wheel(x, 0.80f, mesh);
  }
  const int cell = random.below(64);
  for (const float x : {-half - 0.06f, half + 0.06f}) {
    mesh.add_cell_quad({Vector3f(x, -0.26f, 0.42f), Vector3f(0, 0.52f, 0), Vector3f(0, 0, 0.12f)},
                       p::kPlate,
                       p::kPostersTile_m,
                       cell);
    for (const float y : {-0.78f, 0.48f}) {
      mesh.add_box(Vector3f(x - 0.02f, y, 0.58f),
                   Vector3f(x + 0.02f, y + 0.3f, 0.74f),
                   x > 0 ? p::kFrameWhite : p::kCarRed);
    }
  }
  // Door gaps and handles.
  for (const float y : {-0.866f, 0.862f}) {
    for (const float x : {-0.9f, 0.1f, 1.0f}) {
      mesh.add_box(Vector3f(x, y, 0.34f), Vector3f(x + 0.015f, y + 0.004f, 0.86f), p::kRubber);
      mesh.add_box(
          Vector3f(x - 0.25f, y, 0.72f), Vector3f(x - 0.08f, y + 0.004f, 0.76f), p::kFrameDark);
    }
  }
  return mesh;
}

Mesh make_person(SequentialRandom& random) {
  Mesh mesh;
  const float height = random.between(1.55f, 1.9f);
  const int shirt = p::kClothBlue + random.below(3);
  const float hip = 0.5f * height;
  const float shoulder = 0.82f * height;
  mesh.add_tube({0.12f, 0.1f, 0}, {0, 0.09f, hip}, {0.07f, 0.09f}, 8, p::kTrousers);
  mesh.add_tube({-0.14f, -0.1f, 0}, {0, -0.09f, hip}, {0.07f, 0.09f}, 8, p::kTrousers);
  mesh.add_tube({0, 0, hip - 0.05f}, {0, 0, shoulder}, {0.18f, 0.21f}, 10, shirt);
  mesh.add_tube({0.05f, 0.24f, hip}, {0, 0.22f, shoulder}, {0.045f, 0.06f}, 6, shirt);
  mesh.add_tube({-0.05f, -0.24f, hip}, {0, -0.22f, shoulder}, {0.045f, 0.06f}, 6, shirt);
  mesh.add_tube({0, 0, shoulder}, {0, 0, height - 0.2f}, {0.06f, 0.06f}, 6, p::kSkin);
  mesh.add_tube({0, 0, height - 0.24f}, {0, 0, height}, {0.095f, 0.085f}, 10, p::kSkin);
  mesh.add_tube(
      {-0.02f, 0, height - 0.1f}, {-0.02f, 0, height + 0.02f}, {0.1f, 0.07f}, 10, p::kCarBlack);
  if (random.chance(0.5)) {
    mesh.add_box(
        Vector3f(-0.36f, -0.15f, hip + 0.1f), Vector3f(-0.17f, 0.15f, shoulder), p::kClothRed);
  }
  return mesh;
}

Mesh make_lamp_post() {
  Mesh mesh;
  mesh.add_tube({0, 0, 0}, {0, 0, 0.9f}, {0.11f, 0.09f}, 10, p::kPole);
  mesh.add_tube({0, 0, 0.9f}, {0, 0, 6.2f}, {0.06f, 0.045f}, 8, p::kPole);
  mesh.add_tube({0, 0, 6.1f}, {1.3f, 0, 6.4f}, {0.04f, 0.03f}, 6, p::kPole);
  mesh.add_box(Vector3f(1.0f, -0.12f, 6.38f), Vector3f(1.6f, 0.12f, 6.48f), p::kFrameDark);
  return mesh;
}

Mesh make_sign(SequentialRandom& random) {
  Mesh mesh;
  const float width = random.between(0.5f, 0.9f);
  mesh.add_tube({0, 0, 0}, {0, 0, 2.6f}, {0.035f, 0.035f}, 8, p::kPole);
  const Vector3f low(-0.045f, -0.5f * width, 1.9f);
  mesh.add_cell_quad({low, Vector3f(0, width, 0), Vector3f(0, 0, 0.7f)},
                     p::kPlate,
                     p::kPostersTile_m,
                     random.below(64));
  return mesh;
}

Mesh make_bench() {
  Mesh mesh;
  for (int slat = 0; slat < 4; ++slat) {
    const float y = 0.13f * static_cast<float>(slat);
    mesh.add_box(Vector3f(-0.9f, y, 0.43f), Vector3f(0.9f, y + 0.1f, 0.47f), p::kWood);
    if (slat < 3) {
      const float z = 0.55f + y;
      mesh.add_box(Vector3f(-0.9f, 0.52f, z), Vector3f(0.9f, 0.56f, z + 0.1f), p::kWood);
    }
  }
  for (const float x : {-0.75f, 0.7f}) {
    mesh.add_box(Vector3f(x, 0.0f, 0.0f), Vector3f(x + 0.05f, 0.5f, 0.43f), p::kFrameDark);
    mesh.add_box(Vector3f(x, 0.56f, 0.0f), Vector3f(x + 0.05f, 0.6f, 0.95f), p::kFrameDark);
  }
  return mesh;
}

Mesh make_kiosk(SequentialRandom& random) {
  Mesh mesh;
  mesh.add_tube({0, 0, 0}, {0, 0, 0.35f}, {0.75f, 0.75f}, 16, p::kConcrete);
  // An advertising column: eight posters around.
  for (int side = 0; side < 8; ++side) {
    const float a0 = static_cast<float>(side) * std::numbers::pi_v<float> / 4.0f;
    const float a1 = a0 + std::numbers::pi_v<float> / 4.0f;
    const Vector3f p0(0.62f * std::cos(a0), 0.62f * std::sin(a0), 0.35f);
    const Vector3f p1(0.62f * std::cos(a1), 0.62f * std::sin(a1), 0.35f);
    for (const float z : {0.0f, 1.1f}) {
      mesh.add_cell_quad({p0 + Vector3f(0, 0, z), p1 - p0, Vector3f(0, 0, 1.05f)},
                         p::kPosters,
                         p::kPostersTile_m,
                         random.below(64));
    }
  }
  mesh.add_tube({0, 0, 2.5f}, {0, 0, 2.9f}, {0.85f, 0.5f}, 16, p::kFrameDark);
  return mesh;
}

Mesh make_monument() {
  Mesh mesh;
  for (int step = 0; step < 4; ++step) {
    const float half = 2.4f - 0.45f * static_cast<float>(step);
    const float z = 0.18f * static_cast<float>(step);
    mesh.add_box(Vector3f(-half, -half, z), Vector3f(half, half, z + 0.18f), p::kKerb);
  }
  mesh.add_box(Vector3f(-0.7f, -0.7f, 0.72f), Vector3f(0.7f, 0.7f, 2.2f), p::kConcrete);
  mesh.add_box(Vector3f(-0.85f, -0.85f, 2.2f), Vector3f(0.85f, 0.85f, 2.4f), p::kKerb);
  mesh.add_tube({0, 0, 2.4f}, {0, 0, 5.6f}, {0.36f, 0.26f}, 14, p::kConcrete);
  mesh.add_tube({0, 0, 5.6f}, {0, 0, 6.6f}, {0.55f, 0.05f}, 10, p::kFrameDark);
  return mesh;
}

}  // namespace camvox::simulation
