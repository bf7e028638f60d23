#include <algorithm>
#include <cmath>

#include "palette.hpp"
#include "props.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
namespace p = palette;

/// Places things on a wall: x along it, y up, z out of it.
class Wall {
 public:
  Wall(const FacadePlan& plan, Mesh& mesh)
      : plan_(plan), out_(plan.along.y(), -plan.along.x(), 0.0f), mesh_(mesh) {}

  [[nodiscard]] Vector3f at(float x, float y, float z) const {
    return plan_.start + x * plan_.along + Vector3f(0, 0, y) + z * out_;
  }
  void box(const Vector3f& low, const Vector3f& high, int material) {
    const Vector3f size = high - low;
    mesh_.add_box(at(low.x(), low.y(), low.z()),
                  {size.x() * plan_.along, size.z() * out_, Vector3f(0, 0, size.y())},
                  material,
                  {low.x(), low.y()});
  }
  void picture(const Vector3f& low, const Vector2f& size, int material, int cell) {
    mesh_.add_cell_quad(
        {at(low.x(), low.y(), low.z()), size.x() * plan_.along, Vector3f(0, 0, size.y())},
        material,
        p::kPostersTile_m,
        cell);
  }
  void plane(int material, const Vector2f& uv) {
    mesh_.add_quad(
        plan_.start, plan_.length_m * plan_.along, Vector3f(0, 0, plan_.height_m), material, uv);
  }

 private:
  FacadePlan plan_;
  Vector3f out_;
  Mesh& mesh_;
};

void add_window(Wall& wall, const Vector2f& low, const Vector2f& size, int frame, int cell) {
  const float x0 = low.x();
  const float x1 = low.x() + size.x();
  const float y0 = low.y();
  const float y1 = low.y() + size.y();
  wall.picture({x0, y0, 0.02f}, size, p::kWindows, cell);
  wall.box({x0 - 0.08f, y0 - 0.1f, 0.0f}, {x1 + 0.08f, y0, 0.16f}, p::kKerb);
  wall.box({x0 - 0.08f, y1, 0.0f}, {x1 + 0.08f, y1 + 0.09f, 0.09f}, frame);
  wall.box({x0 - 0.08f, y0, 0.0f}, {x0, y1, 0.07f}, frame);
  wall.box({x1, y0, 0.0f}, {x1 + 0.08f, y1, 0.07f}, frame);
}

void add_balcony(Wall& wall, float x, float y, float width) {
  wall.box({x, y, 0.0f}, {x + width, y + 0.15f, 1.0f}, p::kConcrete);
  wall.box({x, y + 1.05f, 0.94f}, {x + width, y + 1.12f, 1.0f}, p::kFrameDark);
  for (float bar = 0.0f; bar < width; bar += 0.22f) {
    wall.box({x + bar, y + 0.15f, 0.96f}, {x + bar + 0.03f, y + 1.05f, 0.99f}, p::kFrameDark);
  }
}

/// What a bay of the ground floor holds: a door, a shop window, a poster, or an ordinary window.
void add_ground_bay(Wall& wall, float x, float width, int frame, SequentialRandom& random) {
  const int kind = random.below(5);
  if (kind == 0) {
    wall.box({x + 0.5f, 0.0f, 0.0f}, {x + 0.5f + 1.2f, 2.3f, 0.05f}, p::kDoor);
    wall.box({x + 0.3f, 2.5f, 0.0f}, {x + 1.9f, 2.62f, 0.9f}, p::kFrameDark);
    wall.picture({x + 1.85f, 1.3f, 0.03f}, {0.35f, 0.5f}, p::kPosters, random.below(64));
  } else if (kind == 1) {
    add_window(wall, {x + 0.25f, 0.7f}, {width - 0.5f, 1.8f}, p::kFrameDark, random.below(64));
    wall.picture({x + 0.3f, 2.62f, 0.1f}, {width - 0.6f, 0.55f}, p::kPosters, random.below(64));
  } else if (kind == 2) {
    wall.picture({x + 0.4f, 0.8f, 0.03f}, {1.3f, 1.6f}, p::kPosters, random.below(64));
  } else {
    add_window(wall, {x + 0.5f, 1.0f}, {width - 1.2f, 1.5f}, frame, random.below(64));
  }
}

/// Pipes, air conditioners, a lamp: small things that stand out of the wall.
void add_fittings(Wall& wall, const FacadePlan& plan, SequentialRandom& random) {
  for (float x = random.between(0.3f, 4.0f); x < plan.length_m - 0.3f;
       x += random.between(6.0f, 14.0f)) {
    wall.box({x, 0.0f, 0.02f}, {x + 0.1f, plan.height_m, 0.12f}, p::kPole);
  }
  const int units = random.below(static_cast<int>(plan.length_m / 4.0f) + 1);
  for (int i = 0; i < units; ++i) {
    const float x = random.between(0.5f, plan.length_m - 1.5f);
    const float y = random.between(2.8f, std::max(3.0f, plan.height_m - 1.5f));
    wall.box({x, y, 0.05f}, {x + 0.8f, y + 0.55f, 0.4f}, p::kFrameWhite);
    wall.box({x + 0.1f, y + 0.08f, 0.4f}, {x + 0.5f, y + 0.47f, 0.41f}, p::kFrameDark);
  }
}

}  // namespace

BuildingStyle random_style(SequentialRandom& random) {
  const int walls[] = {p::kBrickRed,
                       p::kBrickBrown,
                       p::kPlasterWhite,
                       p::kPlasterYellow,
                       p::kPlasterGrey,
                       p::kConcrete};
  return {walls[random.below(6)],
          random.between(2.9f, 3.6f),
          random.between(2.4f, 3.6f),
          random.chance(0.3)};
}

void add_facade(const FacadePlan& plan,
                const BuildingStyle& style,
                SequentialRandom& random,
                Mesh& mesh) {
  Wall wall(plan, mesh);
  wall.plane(style.wall_material, {random.between(0.0f, 50.0f), random.between(0.0f, 50.0f)});
  wall.box({0.0f, 0.0f, 0.0f}, {plan.length_m, 0.5f, 0.08f}, p::kConcrete);
  wall.box({0.0f, plan.height_m - 0.4f, 0.0f}, {plan.length_m, plan.height_m, 0.3f}, p::kKerb);
  const int frame = random.chance(0.5) ? p::kFrameWhite : p::kFrameDark;
  const int bays = std::max(1, static_cast<int>(plan.length_m / style.bay_width_m));
  const float bay = plan.length_m / static_cast<float>(bays);
  const int floors = static_cast<int>((plan.height_m - 0.6f) / style.floor_height_m);
  for (int column = 0; column < bays; ++column) {
    const float x = bay * static_cast<float>(column);
    add_ground_bay(wall, x, bay, frame, random);
    const bool balcony = style.balconies && random.chance(0.35);
    for (int floor = 1; floor < floors; ++floor) {
      const float y = style.floor_height_m * static_cast<float>(floor);
      if (random.chance(0.06)) continue;
      const float inset = random.chance(0.85) ? 0.5f : 0.8f;
      add_window(
          wall, {x + inset, y + 0.85f}, {bay - 2.0f * inset, 1.45f}, frame, random.below(64));
      if (balcony) add_balcony(wall, x + 0.2f, y, bay - 0.4f);
    }
  }
  add_fittings(wall, plan, random);
}

void add_building(const Vector2f& low,
                  const Vector2f& high,
                  float height_m,
                  SequentialRandom& random,
                  Mesh& mesh) {
  const BuildingStyle style = random_style(random);
  const Vector2f size = high - low;
  const Vector3f x = Vector3f::UnitX();
  const Vector3f y = Vector3f::UnitY();
  add_facade({{low.x(), low.y(), 0}, x, size.x(), height_m}, style, random, mesh);
  add_facade({{high.x(), low.y(), 0}, y, size.y(), height_m}, style, random, mesh);
  add_facade({{high.x(), high.y(), 0}, -x, size.x(), height_m}, style, random, mesh);
  add_facade({{low.x(), high.y(), 0}, -y, size.y(), height_m}, style, random, mesh);
  mesh.add_quad({low.x(), low.y(), height_m}, size.x() * x, size.y() * y, p::kRoof);
}

}  // namespace camvox::simulation
