#pragma once

#include <Eigen/Core>
#include <span>

namespace camvox::bench {

/// What stands around a place, seen from above: by distance and direction, how high it reaches.
/// After "scan context" (Kim, Kim, IROS 2018); ours is of surroundings, not of one scan, and leaves
/// out what lies below the camera.
class RingDescriptor {
 public:
  static constexpr int kRings = 20;
  static constexpr int kSectors = 60;
  using Image = Eigen::Matrix<float, kRings, kSectors>;

  RingDescriptor() = default;
  /// `points_level`: z up, origin in the place.
  RingDescriptor(std::span<const Eigen::Vector3f> points_level, double max_range_m);

  struct Distance {
    double value = 1.0;    ///< 0: the same; 1: nothing in common.
    double yaw_rad = 0.0;  ///< By which the other one is turned about z: yaw of T_this_other.
  };
  /// Smallest over all turns of the other one by `min_turn_rad` or more to either side.
  [[nodiscard]] Distance distance(const RingDescriptor& other, double min_turn_rad = 0.0) const;

  [[nodiscard]] const Image& image() const { return image_; }

 private:
  Image image_ = Image::Zero();
  Eigen::Array<float, kSectors, 1> norms_ = Eigen::Array<float, kSectors, 1>::Zero();
};

}  // namespace camvox::bench
