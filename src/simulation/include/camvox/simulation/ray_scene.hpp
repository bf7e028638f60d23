#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "camvox/simulation/world.hpp"

namespace camvox::simulation {

/// A line of sight in world coordinates. Distances are in units of the length of `direction`: a
/// camera ray with z = 1 in the camera frame measures depth.
struct Ray {
  Eigen::Vector3f origin_world;
  Eigen::Vector3f direction_world;
  float time = 0.0f;  ///< 0 to 1 within the interval of RayScene::set_interval.
};

/// What a ray meets first.
struct Hit {
  static constexpr std::uint32_t kNothing = 0xffffffffu;
  float distance = std::numeric_limits<float>::infinity();
  std::uint32_t object = kNothing;  ///< 0: scenery; i + 1: moving object i.
  std::uint32_t triangle = 0;       ///< In the object's mesh.
  float u = 0.0f;                   ///< Barycentric coordinates on the triangle.
  float v = 0.0f;

  [[nodiscard]] bool found() const { return object != kNothing; }
};

/// The surface at a hit.
struct Surface {
  const Material* material;
  Eigen::Vector2f uv_m;
  Eigen::Vector3f normal_world;  ///< Unit, of either sign.
};

/// Finds what rays hit in a world, standing and moving; camera and lidar share one, so both see
/// the same geometry. Uses Intel Embree. Queries may run in several threads at once, but not
/// during set_interval.
class RayScene {
 public:
  /// Builds the search structures. `world` must outlive the scene. Throws std::runtime_error
  /// when Embree cannot be started.
  explicit RayScene(const World& world);
  ~RayScene();
  RayScene(RayScene&&) noexcept;
  RayScene& operator=(RayScene&&) noexcept;

  /// Puts the moving objects on their way from `start_s` to `end_s`; a ray's time picks the
  /// moment in between.
  void set_interval(double start_s, double end_s);

  /// One hit per ray. The two must be of the same size. Results do not depend on how the rays
  /// are split over calls and threads, as long as the splits fall on multiples of 16.
  void intersect(std::span<const Ray> rays, std::span<Hit> hits) const;

  /// Whether anything at all is in the way of each ray, 1 or 0.
  void occluded(std::span<const Ray> rays, std::span<std::uint8_t> blocked) const;

  /// The surface at a found hit.
  [[nodiscard]] Surface surface(const Hit& hit) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace camvox::simulation
