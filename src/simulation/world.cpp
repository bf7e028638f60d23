#include "camvox/simulation/world.hpp"

#include <algorithm>
#include <cmath>

#include "palette.hpp"
#include "props.hpp"
#include "world_parts.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector2f;

/// Heading changes over this distance before and after a corner.
constexpr float kCornerReach_m = 1.5f;

float length_of(const std::vector<Vector2f>& corners) {
  float length = 0.0f;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    length += (corners[(i + 1) % corners.size()] - corners[i]).norm();
  }
  return length;
}

Vector2f point_on(const std::vector<Vector2f>& corners, float distance) {
  for (std::size_t i = 0;; i = (i + 1) % corners.size()) {
    const Vector2f step = corners[(i + 1) % corners.size()] - corners[i];
    const float length = step.norm();
    if (distance <= length) return corners[i] + step * (distance / length);
    distance -= length;
  }
}

}  // namespace

GroundPose MovingObject::pose(double time_s) const {
  const float perimeter = length_of(corners_world);
  const auto wrap = [perimeter](double distance) {
    return static_cast<float>(distance - std::floor(distance / perimeter) * perimeter);
  };
  const double distance = start_m + speed_m_s * time_s;
  const Vector2f behind = point_on(corners_world, wrap(distance - kCornerReach_m));
  const Vector2f middle = point_on(corners_world, wrap(distance));
  const Vector2f ahead = point_on(corners_world, wrap(distance + kCornerReach_m));
  // The mean over a chord cuts the corners smoothly.
  const Vector2f position = 0.25f * behind + 0.5f * middle + 0.25f * ahead;
  const Vector2f heading = ahead - behind;
  return {position, std::atan2(heading.y(), heading.x())};
}

std::vector<Vector2f> rectangle(float x0, float y0, float x1, float y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

void add_traffic(const WorldConfig& options,
                 const Circuits& walks,
                 const Circuits& drives,
                 World& world) {
  SequentialRandom random(world.seed, 900);
  for (int i = 0; i < options.people && !walks.empty(); ++i) {
    MovingObject person;
    person.mesh = make_person(random);
    person.corners_world = walks[static_cast<std::size_t>(i) % walks.size()];
    if (random.chance(0.5)) std::reverse(person.corners_world.begin(), person.corners_world.end());
    person.speed_m_s = random.between(0.8f, 1.6f);
    person.start_m = random.between(0.0f, length_of(person.corners_world));
    person.ground_height_m = world.kind == "corridor" ? 0.0f : 0.12f;
    world.moving.push_back(std::move(person));
  }
  for (int i = 0; i < options.cars && !drives.empty(); ++i) {
    MovingObject car;
    car.mesh = make_car(random);
    car.corners_world = drives[static_cast<std::size_t>(i) % drives.size()];
    car.speed_m_s = random.between(3.0f, 6.0f);
    car.start_m = random.between(0.0f, length_of(car.corners_world));
    world.moving.push_back(std::move(car));
  }
}

World make_world(const WorldConfig& options) {
  config::require_valid(options, "world");
  World world;
  world.kind = options.kind;
  world.seed = static_cast<std::uint64_t>(options.seed);
  world.materials = make_palette();
  SequentialRandom random(world.seed, 100);
  if (world.kind == "campus") build_campus(random, world);
  if (world.kind == "street") build_street(random, world);
  if (world.kind == "plaza") build_plaza(random, world);
  if (world.kind == "corridor") build_corridor(random, world);
  add_traffic(options, walks_of(world), drives_of(world), world);
  return world;
}

}  // namespace camvox::simulation
