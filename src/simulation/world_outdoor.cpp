#include <cmath>
#include <numbers>

#include "palette.hpp"
#include "props.hpp"
#include "world_parts.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
namespace p = palette;
constexpr float kPi = std::numbers::pi_v<float>;

constexpr float kRoadHalf_m = 5.0f;     ///< Half the width of the roadway.
constexpr float kSidewalk_m = 3.0f;     ///< Width of a sidewalk.
constexpr float kKerb_m = 0.12f;        ///< Height of a sidewalk above the road.
constexpr int kCrossings = 4;           ///< Campus: crossings along each axis.
const Vector2f kBlock_m(64.0f, 52.0f);  ///< Campus: distance of the crossings.

void add_ground(float half_m, int material, Mesh& mesh) {
  // In pieces, so that texture coordinates stay small and exact.
  constexpr float kPiece_m = 40.0f;
  for (float x = -half_m; x < half_m; x += kPiece_m) {
    for (float y = -half_m; y < half_m; y += kPiece_m) {
      mesh.add_quad({x, y, 0}, {kPiece_m, 0, 0}, {0, kPiece_m, 0}, material, {x, y});
    }
  }
}

void add_slab(const Vector2f& low, const Vector2f& high, float z, int material, Mesh& mesh) {
  const Vector2f size = high - low;
  mesh.add_quad({low.x(), low.y(), z}, {size.x(), 0, 0}, {0, size.y(), 0}, material, low);
}

/// A raised block: kerb stones around, paving inside.
void add_pavement(const Vector2f& low, const Vector2f& high, Mesh& mesh) {
  mesh.add_box(Vector3f(low.x(), low.y(), 0), Vector3f(high.x(), high.y(), kKerb_m), p::kKerb);
  const Vector2f inset = Vector2f::Constant(0.15f);
  add_slab(low + inset, high - inset, kKerb_m + 0.003f, p::kSidewalk, mesh);
}

/// Dashes along the middle of a road from `a` to `b`, stop lines and patches beside them.
void add_markings(const Vector2f& a, const Vector2f& b, SequentialRandom& random, Mesh& mesh) {
  const Vector2f direction = (b - a).normalized();
  const Vector2f side(-direction.y(), direction.x());
  const auto flat = [&](float along, float across, const Vector2f& size, int material, float z) {
    const Vector2f corner = a + along * direction + across * side;
    mesh.add_quad({corner.x(), corner.y(), z},
                  {direction.x() * size.x(), direction.y() * size.x(), 0},
                  {side.x() * size.y(), side.y() * size.y(), 0},
                  material,
                  {random.between(0.0f, 3.0f), random.between(0.0f, 3.0f)});
  };
  const float length = (b - a).norm();
  for (float along = kRoadHalf_m + 3.0f; along < length - kRoadHalf_m - 4.0f; along += 5.0f) {
    flat(along, -0.07f, {2.2f, 0.14f}, p::kRoadMarking, 0.006f);
  }
  for (const float across : {-kRoadHalf_m + 0.3f, kRoadHalf_m - 0.42f}) {
    flat(kRoadHalf_m + 3.0f,
         across,
         {length - 2 * kRoadHalf_m - 6.0f, 0.12f},
         p::kRoadMarking,
         0.005f);
  }
  for (const float along : {kRoadHalf_m + 0.3f, length - kRoadHalf_m - 2.8f}) {
    for (float across = -kRoadHalf_m + 0.5f; across < kRoadHalf_m - 0.5f; across += 1.0f) {
      flat(along, across, {2.5f, 0.5f}, p::kRoadMarking, 0.005f);
    }
  }
  for (float along = 8.0f; along < length - 8.0f; along += random.between(4.0f, 9.0f)) {
    const Vector2f size(random.between(0.4f, 2.5f), random.between(0.4f, 1.2f));
    const int material = random.chance(0.5) ? p::kConcrete : p::kFrameDark;
    flat(along, random.between(-4.2f, 3.0f), size, material, 0.003f);
  }
}

struct Placing {
  Vector2f start;
  Vector2f end;
  float step_m;
  float chance;
};

/// Repeats a thing along a line, with some left out and none exactly in place.
template <typename Make>
void place_along(
    const Placing& line, float yaw, SequentialRandom& random, Make make, World& world) {
  const Vector2f direction = (line.end - line.start).normalized();
  const float length = (line.end - line.start).norm();
  for (float along = 0.5f * line.step_m; along < length; along += line.step_m) {
    if (!random.chance(line.chance)) continue;
    const Vector2f at = line.start + (along + random.between(-0.5f, 0.5f)) * direction;
    world.scenery.append(make(), {at.x(), at.y(), 0.0f}, yaw + random.between(-0.06f, 0.06f));
  }
}

/// Trees, lamps, signs, benches and parked cars along one side of a road.
void furnish_side(const Vector2f& a, const Vector2f& b, SequentialRandom& random, World& world) {
  const Vector2f direction = (b - a).normalized();
  const Vector2f outward(direction.y(), -direction.x());
  const float yaw = std::atan2(direction.y(), direction.x());
  const Vector2f trim = (kRoadHalf_m + 4.0f) * direction;
  const auto line = [&](float across) {
    return std::pair<Vector2f, Vector2f>{a + trim + across * outward, b - trim + across * outward};
  };
  const auto [t0, t1] = line(kRoadHalf_m + 0.8f);
  place_along(
      {t0, t1, 8.0f, 0.6f}, 0.0f, random, [&] { return make_tree(random); }, world);
  place_along(
      {t0, t1, 21.0f, 0.9f}, yaw + kPi / 2, random, [] { return make_lamp_post(); }, world);
  place_along(
      {t0, t1, 13.0f, 0.5f}, yaw + kPi, random, [&] { return make_sign(random); }, world);
  const auto [c0, c1] = line(kRoadHalf_m - 1.1f);
  place_along(
      {c0, c1, 6.2f, 0.4f}, yaw, random, [&] { return make_car(random); }, world);
  const auto [s0, s1] = line(kRoadHalf_m + kSidewalk_m - 0.9f);
  place_along(
      {s0, s1, 17.0f, 0.4f}, yaw + kPi, random, [] { return make_bench(); }, world);
  place_along(
      {s0, s1, 9.0f, 0.4f}, 0.0f, random, [&] { return make_bush(random); }, world);
  place_along(
      {s0, s1, 33.0f, 0.5f}, 0.0f, random, [&] { return make_kiosk(random); }, world);
}

/// A city block: buildings around a lawn, or a park with trees only.
void add_block(const Vector2f& low, const Vector2f& high, SequentialRandom& random, World& world) {
  Mesh& mesh = world.scenery;
  add_pavement(low, high, mesh);
  const Vector2f margin = Vector2f::Constant(kSidewalk_m);
  const Vector2f a = low + margin;
  const Vector2f b = high - margin;
  add_slab(a, b, kKerb_m + 0.01f, p::kLawn, mesh);
  if (random.chance(0.15)) {
    for (int i = 0; i < 22; ++i) {
      const Vector3f at(
          random.between(a.x() + 2, b.x() - 2), random.between(a.y() + 2, b.y() - 2), kKerb_m);
      mesh.append(make_tree(random), at, 0.0f);
    }
    return;
  }
  // One wide building in front, two behind, gaps between them.
  const float split_y = a.y() + random.between(0.35f, 0.5f) * (b.y() - a.y());
  const float split_x = a.x() + random.between(0.35f, 0.65f) * (b.x() - a.x());
  const auto inset = [&] { return random.between(0.3f, 3.0f); };
  add_building({a.x() + inset(), a.y() + inset()},
               {b.x() - inset(), split_y - 3.0f},
               random.between(9.0f, 20.0f),
               random,
               mesh);
  add_building({a.x() + inset(), split_y + 3.0f},
               {split_x - 2.0f, b.y() - inset()},
               random.between(7.0f, 24.0f),
               random,
               mesh);
  add_building({split_x + 2.0f, split_y + 3.0f},
               {b.x() - inset(), b.y() - inset()},
               random.between(6.0f, 16.0f),
               random,
               mesh);
}

}  // namespace

void build_campus(SequentialRandom& random, World& world) {
  world.block_m = kBlock_m;
  add_ground(240.0f, p::kAsphalt, world.scenery);
  const float edge = kRoadHalf_m;
  for (int i = -1; i < kCrossings; ++i) {
    for (int j = -1; j < kCrossings; ++j) {
      const Vector2f corner(static_cast<float>(i) * kBlock_m.x(),
                            static_cast<float>(j) * kBlock_m.y());
      add_block(corner + Vector2f::Constant(edge),
                corner + kBlock_m - Vector2f::Constant(edge),
                random,
                world);
    }
  }
  for (int i = 0; i < kCrossings; ++i) {
    for (int j = 0; j < kCrossings; ++j) {
      const Vector2f here(static_cast<float>(i) * kBlock_m.x(),
                          static_cast<float>(j) * kBlock_m.y());
      for (const Vector2f& step : {Vector2f(kBlock_m.x(), 0.0f), Vector2f(0.0f, kBlock_m.y())}) {
        const Vector2f there = here + step;
        if (there.x() > 3.1f * kBlock_m.x() || there.y() > 3.1f * kBlock_m.y()) continue;
        add_markings(here, there, random, world.scenery);
        furnish_side(here, there, random, world);
        furnish_side(there, here, random, world);
      }
    }
  }
}

void build_street(SequentialRandom& random, World& world) {
  constexpr float kHalfLength_m = 150.0f;
  add_ground(200.0f, p::kAsphalt, world.scenery);
  for (const float side : {-1.0f, 1.0f}) {
    const float inner = side * kRoadHalf_m;
    const float outer = side * (kRoadHalf_m + kSidewalk_m);
    add_pavement({-kHalfLength_m, std::min(inner, side * 22.0f)},
                 {kHalfLength_m, std::max(inner, side * 22.0f)},
                 world.scenery);
    for (float x = -kHalfLength_m; x < kHalfLength_m;) {
      const float width = random.between(12.0f, 26.0f);
      const float setback = outer + side * random.between(0.0f, 0.6f);
      add_building({x, std::min(setback, setback + side * 12.0f)},
                   {x + width, std::max(setback, setback + side * 12.0f)},
                   random.between(14.0f, 26.0f),
                   random,
                   world.scenery);
      x += width + (random.chance(0.15) ? 4.0f : 0.0f);
    }
  }
  const Vector2f west(-kHalfLength_m, 0.0f);
  const Vector2f east(kHalfLength_m, 0.0f);
  add_markings(west, east, random, world.scenery);
  furnish_side(west, east, random, world);
  furnish_side(east, west, random, world);
}

void build_plaza(SequentialRandom& random, World& world) {
  add_ground(80.0f, p::kSidewalk, world.scenery);
  for (int i = 0; i < 6; ++i) {
    const float x = -48.0f + 16.0f * static_cast<float>(i);
    add_building({x, 24.0f + random.between(0.0f, 2.0f)},
                 {x + 15.0f, 36.0f},
                 random.between(8.0f, 19.0f),
                 random,
                 world.scenery);
    add_building({x, -38.0f},
                 {x + 15.5f, -26.0f - random.between(0.0f, 2.0f)},
                 random.between(8.0f, 19.0f),
                 random,
                 world.scenery);
  }
  for (int j = 0; j < 3; ++j) {
    const float y = -24.0f + 16.0f * static_cast<float>(j);
    add_building({40.0f + random.between(0.0f, 2.0f), y},
                 {54.0f, y + 15.0f},
                 random.between(8.0f, 22.0f),
                 random,
                 world.scenery);
    add_building({-56.0f, y},
                 {-42.0f - random.between(0.0f, 2.0f), y + 15.0f},
                 random.between(8.0f, 22.0f),
                 random,
                 world.scenery);
  }
  world.scenery.append(make_monument(), {4.0f, 1.0f, 0.0f}, 0.3f);
  for (int i = 0; i < 12; ++i) {
    const float angle = kPi * static_cast<float>(i) / 6.0f;
    const Vector3f ring(10.5f * std::cos(angle), 5.5f * std::sin(angle), 0.0f);
    world.scenery.append(make_bench(), ring, angle - kPi / 2);
    const Vector3f outer(33.0f * std::cos(angle), 20.0f * std::sin(angle), 0.0f);
    world.scenery.append(i % 3 == 0 ? make_kiosk(random) : make_tree(random), outer, 0.0f);
    const Vector3f between(35.0f * std::cos(angle + 0.26f), 21.5f * std::sin(angle + 0.26f), 0.0f);
    world.scenery.append(i % 2 == 0 ? make_lamp_post() : make_sign(random), between, angle);
    const Vector3f planter(13.0f * std::cos(angle + 0.2f), 7.5f * std::sin(angle + 0.2f), 0.0f);
    if (i % 3 == 1) world.scenery.append(make_bush(random), planter, 0.0f);
  }
  for (int i = 0; i < 5; ++i) {
    world.scenery.append(make_car(random), {37.0f, -20.0f + 6.5f * static_cast<float>(i), 0}, 0.1f);
    world.scenery.append(make_car(random), {-39.0f, -19.0f + 7.0f * static_cast<float>(i), 0}, kPi);
  }
}

Circuits walks_of(const World& world) {
  if (world.kind == "plaza") {
    return {rectangle(-30, -17.5f, 30, 17.5f),
            rectangle(-26, 16.0f, 27, 19.0f),
            rectangle(18, -16, 29, 15)};
  }
  if (world.kind == "street")
    return {rectangle(-90, 6.6f, 90, 7.1f), rectangle(-90, -7.1f, 90, -6.6f)};
  if (world.kind == "corridor") return {rectangle(6, -0.9f, 40, -0.7f)};
  Circuits walks;
  const float edge = kRoadHalf_m + 1.9f;
  for (int i = 0; i < kCrossings - 1; ++i) {
    for (int j = 0; j < kCrossings - 1; ++j) {
      const float x = static_cast<float>(i) * kBlock_m.x();
      const float y = static_cast<float>(j) * kBlock_m.y();
      walks.push_back(
          rectangle(x + edge, y + edge, x + kBlock_m.x() - edge, y + kBlock_m.y() - edge));
    }
  }
  return walks;
}

Circuits drives_of(const World& world) {
  constexpr float kLane_m = 2.4f;
  if (world.kind == "street") return {rectangle(-140, -kLane_m, 140, kLane_m)};
  if (world.kind != "campus") return {};
  const Vector2f far = 3.0f * kBlock_m;
  return {
      rectangle(-kLane_m, -kLane_m, far.x() + kLane_m, far.y() + kLane_m),
      rectangle(-kLane_m, kBlock_m.y() - kLane_m, far.x() + kLane_m, 2 * kBlock_m.y() + kLane_m)};
}

}  // namespace camvox::simulation
