#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "camvox/config/parameters.hpp"

namespace camvox::lidar {

/// When the rig counts as standing still. YAML keys are the field names.
struct StationaryConfig {
  double max_gyro_sigma_rad_s = 0.01;  ///< Spread of the angular rate per axis.
  double max_gyro_mean_rad_s = 0.05;   ///< Its mean: above the largest bias to be expected.
  double max_force_sigma_m_s2 = 0.15;  ///< Spread of the specific force per axis.
  double max_block_change = 4.0;       ///< Change of a block's mean brightness, grey levels.
  double max_changed_blocks = 0.1;     ///< Part of the blocks that may change (people walk by).
  int min_still_frames = 3;            ///< Frames in a row before the rig counts as still.

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    const auto positive = config::greater_than(0.0);
    field("max_gyro_sigma_rad_s", self.max_gyro_sigma_rad_s, positive);
    field("max_gyro_mean_rad_s", self.max_gyro_mean_rad_s, positive);
    field("max_force_sigma_m_s2", self.max_force_sigma_m_s2, positive);
    field("max_block_change", self.max_block_change, positive, config::at_most(255.0));
    field("max_changed_blocks", self.max_changed_blocks, positive, config::at_most(1.0));
    field("min_still_frames", self.min_still_frames, config::at_least(1), config::at_most(1000));
  }
};

/// Whether IMU samples (rows: gyro x y z rad/s, specific force x y z m/s^2) look like standstill.
/// False for fewer than `kMinStationarySamples`: no evidence is no standstill.
[[nodiscard]] bool imu_is_stationary(std::span<const std::array<double, 6>> samples,
                                     const StationaryConfig& config);
inline constexpr std::size_t kMinStationarySamples = 4;

/// A grey image as means of square blocks: noise averages out, motion stays.
struct BlockImage {
  std::size_t columns = 0;
  std::vector<float> means;
};

/// Means of blocks of `kBlock_px` x `kBlock_px`, borders left out.
[[nodiscard]] BlockImage block_means(const std::uint8_t* grey,
                                     std::size_t width_px,
                                     std::size_t height_px,
                                     std::size_t row_step_bytes);
inline constexpr std::size_t kBlock_px = 16;

/// Part of the blocks whose mean differs by more than the config allows, after a common change of
/// gain is taken out; 1 when the images cannot be compared.
[[nodiscard]] double changed_blocks(const BlockImage& reference,
                                    const BlockImage& image,
                                    const StationaryConfig& config);

/// Joins both kinds of evidence over time. The image is compared with the one at which standing
/// still began, not with the last one, so that a slow creep is noticed; without IMU samples the
/// rig never counts as still, because a blank wall looks still as well.
class StationaryDetector {
 public:
  explicit StationaryDetector(const StationaryConfig& config);

  /// Takes a frame; true if the rig has stood still for min_still_frames.
  bool add(BlockImage image, std::span<const std::array<double, 6>> imu);

 private:
  StationaryConfig config_;
  BlockImage reference_;
  int still_frames_ = 0;
};

}  // namespace camvox::lidar
