#include "camvox/simulation/ray_scene.hpp"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "camvox/simulation/random.hpp"

namespace camvox::simulation {
namespace {

using Eigen::Vector3f;

WorldConfig small_world() {
  WorldConfig options;
  options.kind = "plaza";
  options.people = 3;
  options.cars = 0;
  return options;
}

std::vector<Ray> rays_around(std::size_t count) {
  const CounterRandom random(3, 3);
  std::vector<Ray> rays;
  for (std::uint64_t i = 0; i < count; ++i) {
    const double azimuth = random.between(-3.14, 3.14, i, 0);
    const double up = random.between(-0.3, 0.4, i, 1);
    rays.push_back({{-20, -10, 1},
                    Vector3f(static_cast<float>(std::cos(azimuth)),
                             static_cast<float>(std::sin(azimuth)),
                             static_cast<float>(up))});
  }
  return rays;
}

/// Moeller & Trumbore over every triangle of the scenery.
float brute_force(const Mesh& mesh, const Ray& ray) {
  float nearest = std::numeric_limits<float>::infinity();
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices[ia].cast<double>();
    const Eigen::Vector3d e1 = mesh.vertices[ib].cast<double>() - a;
    const Eigen::Vector3d e2 = mesh.vertices[ic].cast<double>() - a;
    const Eigen::Vector3d d = ray.direction_world.cast<double>();
    const Eigen::Vector3d p = d.cross(e2);
    const double determinant = e1.dot(p);
    if (std::abs(determinant) < 1e-14) continue;
    const Eigen::Vector3d s = ray.origin_world.cast<double>() - a;
    const double u = s.dot(p) / determinant;
    const double v = d.dot(s.cross(e1)) / determinant;
    const double t = e2.dot(s.cross(e1)) / determinant;
    if (u >= 0 && v >= 0 && u + v <= 1 && t > 0.02)
      nearest = std::min(nearest, static_cast<float>(t));
  }
  return nearest;
}

TEST(RayScene, AgreesWithBruteForce) {
  WorldConfig options = small_world();
  options.people = 0;
  const World world = make_world(options);
  const RayScene scene(world);
  const auto rays = rays_around(160);
  std::vector<Hit> hits(rays.size());
  scene.intersect(rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const float expected = brute_force(world.scenery, rays[i]);
    if (std::isinf(expected)) {
      EXPECT_FALSE(hits[i].found()) << i;
    } else {
      EXPECT_NEAR(hits[i].distance, expected, 1e-4f * expected + 1e-4f) << i;
    }
  }
}

TEST(RayScene, MovingObjectsAreWhereTheyShouldBe) {
  const World world = make_world(small_world());
  RayScene scene(world);
  scene.set_interval(10.0, 11.0);
  for (std::size_t i = 0; i < world.moving.size(); ++i) {
    for (const float time : {0.0f, 1.0f}) {
      // From above, onto the top of the head.
      const GroundPose pose = world.moving[i].pose(10.0 + static_cast<double>(time));
      std::vector<Ray> ray = {
          {{pose.position_world.x() + 0.01f, pose.position_world.y() + 0.01f, 3.0f},
           {0, 0, -1},
           time}};
      std::vector<Hit> hit(1);
      scene.intersect(ray, hit);
      EXPECT_EQ(hit[0].object, i + 1);
      EXPECT_LT(hit[0].distance, 1.6f);
    }
  }
}

TEST(RayScene, OcclusionAgreesWithIntersection) {
  // Dense packets of sun rays from small patches, as shadows need them.
  WorldConfig options;
  options.kind = "street";
  const World world = make_world(options);
  const RayScene scene(world);
  const CounterRandom random(5, 5);
  std::vector<Ray> rays;
  for (std::uint64_t i = 0; i < 32'000; ++i) {
    const std::uint64_t patch = i / 16;
    const Vector3f origin(
        static_cast<float>(random.between(-40, 40, patch, 0) + random.between(-0.5, 0.5, i, 3)),
        static_cast<float>(random.between(-8, 8, patch, 1) + random.between(-0.5, 0.5, i, 4)),
        static_cast<float>(random.between(0, 8, patch, 2)));
    rays.push_back({origin, world.lighting.to_sun_world});
  }
  std::vector<std::uint8_t> blocked(rays.size());
  scene.occluded(rays, blocked);
  std::vector<Hit> hits(rays.size());
  scene.intersect(rays, hits);
  for (std::size_t i = 0; i < rays.size(); ++i) EXPECT_EQ(blocked[i] != 0, hits[i].found()) << i;
}

TEST(World, SeedDecidesAndBadOptionsAreRefused) {
  const World a = make_world(small_world());
  const World b = make_world(small_world());
  WorldConfig other = small_world();
  other.seed = 2;
  EXPECT_EQ(a.scenery.vertices, b.scenery.vertices);
  EXPECT_NE(a.scenery.vertices, make_world(other).scenery.vertices);
  other.kind = "moon";
  other.people = -1;
  try {
    (void)make_world(other);
    FAIL();
  } catch (const config::ConfigError& error) {
    EXPECT_EQ(error.problems().size(), 2u);
  }
}

}  // namespace
}  // namespace camvox::simulation
