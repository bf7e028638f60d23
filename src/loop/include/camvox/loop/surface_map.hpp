#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace camvox::loop {

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
  [[nodiscard]] bool has_within(const Eigen::Vector3f& point, float radius_m) const;

  [[nodiscard]] const std::vector<Surface>& surfaces() const { return surfaces_; }
  /// Where something stands upright, seen from above: centres of cells of kCell_m.
  [[nodiscard]] const std::vector<Eigen::Vector2f>& upright() const { return upright_; }

  static constexpr float kNear_m = 0.6F;
  static constexpr float kCell_m = 0.5F;
  /// Lower, under the camera, is the ground and what lies on it.
  static constexpr float kLowest_m = -0.5F;

 private:
  template <typename Use>
  bool for_near(const Eigen::Vector3f& point, float radius_m, Use use) const;
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

}  // namespace camvox::loop
