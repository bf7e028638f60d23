#include "ring_descriptor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace camvox::bench {
namespace {

constexpr float kLowest_m = -0.5F;  ///< Below the camera: the ground and what lies on it.
constexpr float kLevel_m = 0.3F;
constexpr int kLevels = 32;

}  // namespace

RingDescriptor::RingDescriptor(std::span<const Eigen::Vector3f> points_level, double max_range_m) {
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  Eigen::Matrix<std::uint32_t, kRings, kSectors> levels;
  levels.setZero();
  for (const auto& point : points_level) {
    const int level = static_cast<int>(std::floor((point.z() - kLowest_m) / kLevel_m));
    const auto ring =
        static_cast<int>(point.head<2>().norm() / static_cast<float>(max_range_m) * kRings);
    if (level < 0 || ring >= kRings) continue;
    const float turn = std::atan2(point.y(), point.x()) / kTurn + 1.0F;
    const int sector = static_cast<int>(turn * kSectors) % kSectors;
    levels(ring, sector) |= 1U << static_cast<unsigned>(std::min(level, kLevels - 1));
  }
  for (int i = 0; i < levels.size(); ++i) {
    image_(i) = static_cast<float>(std::popcount(levels(i)));
  }
  norms_ = image_.colwise().norm().transpose().array();
}

RingDescriptor::Distance RingDescriptor::distance(const RingDescriptor& other,
                                                  double min_turn_rad) const {
  constexpr double kSector_rad = 2.0 * std::numbers::pi / kSectors;
  const int least = static_cast<int>(std::ceil(min_turn_rad / kSector_rad));
  // All pairs of sectors at once; a turn is a diagonal of them.
  const Eigen::Matrix<float, kSectors, kSectors> products = image_.transpose() * other.image_;
  Distance best;
  for (int turn = least; turn <= kSectors - std::max(least, 1); ++turn) {
    float sum = 0.0F;
    int compared = 0;
    for (int sector = 0; sector < kSectors; ++sector) {
      const int theirs = (sector - turn + kSectors) % kSectors;
      const float norm = norms_[sector] * other.norms_[theirs];
      const bool any = norms_[sector] > 0.0F || other.norms_[theirs] > 0.0F;
      compared += any ? 1 : 0;
      if (norm > 0.0F) sum += products(sector, theirs) / norm;
    }
    const double distance = compared > 0 ? 1.0 - static_cast<double>(sum) / compared : 1.0;
    if (distance >= best.value) continue;
    best = {distance, turn * kSector_rad};
  }
  return best;
}

}  // namespace camvox::bench
