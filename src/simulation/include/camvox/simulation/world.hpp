#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "camvox/config/parameters.hpp"
#include "camvox/simulation/mesh.hpp"

namespace camvox::simulation {

/// Which world to make. YAML keys are the field names.
struct WorldConfig {
  std::string kind = "campus";  ///< campus, street, corridor or plaza.
  std::int64_t seed = 1;        ///< The same seed gives the same world.
  int people = 14;              ///< People that walk about.
  int cars = 4;                 ///< Cars that drive (parked ones come with the world).

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("kind", self.kind, config::one_of({"campus", "street", "corridor", "plaza"}));
    field("seed", self.seed, config::at_least(0));
    field("people", self.people, config::at_least(0), config::at_most(200));
    field("cars", self.cars, config::at_least(0), config::at_most(50));
  }
};

/// Where a moving object is: on the ground, heading along its x axis.
struct GroundPose {
  Eigen::Vector2f position_world;
  float yaw_rad;
};

/// Something that moves at constant speed around a closed polygon, its corners rounded.
struct MovingObject {
  Mesh mesh;
  std::vector<Eigen::Vector2f> corners_world;
  float speed_m_s = 1.0f;
  float start_m = 0.0f;  ///< Where on the polygon it is at time 0.
  float ground_height_m = 0.0f;

  [[nodiscard]] GroundPose pose(double time_s) const;
};

/// The light in a world.
struct Lighting {
  Eigen::Vector3f to_sun_world = Eigen::Vector3f(0.45f, 0.35f, 0.82f).normalized();
  float sun = 1.6f;       ///< Irradiance of a surface that faces the sun; 0 indoors.
  float ambient = 0.55f;  ///< From everywhere, somewhat more from above.
  bool sky = true;        ///< Whether a ray that hits nothing sees sky.
};

/// A place: everything that stands, everything that moves, and the light. z is up, the ground is
/// at z = 0; the streets on which a robot would drive are given by `crossings`.
struct World {
  std::string kind;
  std::uint64_t seed = 0;
  std::vector<Material> materials;
  Mesh scenery;
  std::vector<MovingObject> moving;
  Lighting lighting;
  Eigen::Vector2f block_m = Eigen::Vector2f::Zero();  ///< Campus: distance of the crossings.
};

/// Builds a world. Throws config::ConfigError with all problems of `options`.
[[nodiscard]] World make_world(const WorldConfig& options);

}  // namespace camvox::simulation
