#pragma once

#include <Eigen/Core>

#include "camvox/simulation/mesh.hpp"
#include "camvox/simulation/random.hpp"

namespace camvox::simulation {

/// Things that stand around, each at the origin with z up; a car heads along x.
[[nodiscard]] Mesh make_tree(SequentialRandom& random);
[[nodiscard]] Mesh make_bush(SequentialRandom& random);
[[nodiscard]] Mesh make_car(SequentialRandom& random);
[[nodiscard]] Mesh make_person(SequentialRandom& random);
[[nodiscard]] Mesh make_lamp_post();
[[nodiscard]] Mesh make_sign(SequentialRandom& random);
[[nodiscard]] Mesh make_bench();
[[nodiscard]] Mesh make_kiosk(SequentialRandom& random);
[[nodiscard]] Mesh make_monument();

/// The style of a building.
struct BuildingStyle {
  int wall_material;
  float floor_height_m;
  float bay_width_m;  ///< Distance of one window to the next.
  bool balconies;
};
[[nodiscard]] BuildingStyle random_style(SequentialRandom& random);

/// A straight wall with windows, doors and signs. It runs from `start` along the unit vector
/// `along`; the outside is to the right of it.
struct FacadePlan {
  Eigen::Vector3f start;
  Eigen::Vector3f along;
  float length_m;
  float height_m;
};
void add_facade(const FacadePlan& plan,
                const BuildingStyle& style,
                SequentialRandom& random,
                Mesh& mesh);

/// A box-shaped building with a facade on each side.
void add_building(const Eigen::Vector2f& low,
                  const Eigen::Vector2f& high,
                  float height_m,
                  SequentialRandom& random,
                  Mesh& mesh);

}  // namespace camvox::simulation
