#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "camvox/geometry/se3.hpp"

namespace camvox::bench {

/// Tuning of register_surfaces().
struct RegistrationConfig {
  int starts = 3;                 ///< Best ones of the search that are refined.
  int max_iterations = 15;        ///< Of the refinement.
  double plane_sigma_m = 0.05;    ///< Of a point's distance from a plane that is its own.
  double point_sigma_m = 0.15;    ///< Of its distance from the nearest point of rough surfaces.
  double repeated_points = 30.0;  ///< So many points err together.
  double min_distinction = 0.17;  ///< See Registration.
  double max_rotation_sigma_deg = 0.5;    ///< A pose less certain than this is none.
  double max_translation_sigma_m = 0.25;  ///< The same.
};

/// Points with the planes on which they lie, ready to be searched.
class SurfaceMap {
 public:
  /// `points_level`: thinned, z up, origin in a camera.
  explicit SurfaceMap(const std::vector<Eigen::Vector3f>& points_level);

  struct Surface {
    Eigen::Vector3f point = Eigen::Vector3f::Zero();
    Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< Zero: rough, or too few points.
    [[nodiscard]] bool rough() const { return normal.isZero(); }
  };
  /// The surface with the nearest point within kNear_m; nothing when there is none.
  [[nodiscard]] const Surface* nearest(const Eigen::Vector3f& point) const;

  [[nodiscard]] const std::vector<Surface>& surfaces() const { return surfaces_; }
  /// Where something stands upright, seen from above: centres of cells of kCell_m.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& upright() const { return upright_; }

  static constexpr float kNear_m = 0.6F;
  static constexpr float kCell_m = 0.5F;
  /// Lower, under the camera, is the ground and what lies on it.
  static constexpr float kLowest_m = -0.5F;

 private:
  template <typename Use>
  void for_near(const Eigen::Vector3f& point, Use use) const;
  [[nodiscard]] std::size_t cell(const Eigen::Vector3i& index) const;
  [[nodiscard]] Eigen::Vector3i index_of(const Eigen::Vector3f& point) const;
  [[nodiscard]] Eigen::Vector3f normal_at(const Eigen::Vector3f& point) const;
  void find_upright();

  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  std::vector<std::uint32_t> begin_;  ///< By cell: its first surface; one more at the end.
  std::vector<Surface> surfaces_;     ///< By cell.
  std::vector<Eigen::Vector2f> upright_;
};

enum class RegistrationStatus : std::uint8_t {
  kOk,
  kNothing,      ///< Too little stands there.
  kNotDistinct,  ///< Things coincide hardly better than beside the pose: another place.
  kUncertain,    ///< The pose is not determined well enough, as along a corridor.
};

struct Registration {
  RegistrationStatus status = RegistrationStatus::kNothing;
  geometry::SE3 T_target_source;
  geometry::Matrix6d covariance_source = geometry::Matrix6d::Zero();  ///< T_target_source*exp(xi)
  /// How much more of what is no plane (trees, posts, edges, cars) coincides with the other one's
  /// than it does 1.5 m beside the pose. Planes say nothing: ground and facades are everywhere.
  double distinction = 0.0;
  int points = 0;  ///< With a counterpart.
};

/// Where the search begins and how far it goes.
struct RegistrationStart {
  geometry::SE3 T_target_source;
  double search_m = 5.0;
  double search_yaw_rad = 0.15;
};

/// The pose of one place's surroundings in another's, from what stands there. Search over the
/// ground plane; of the best starts, refinement of distances from planes (Chen, Medioni, 1992) and,
/// where it is rough, from points. Deterministic.
[[nodiscard]] Registration register_surfaces(const SurfaceMap& source,
                                             const SurfaceMap& target,
                                             const RegistrationStart& start,
                                             const RegistrationConfig& config);

}  // namespace camvox::bench
