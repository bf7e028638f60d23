#include "camvox/lidar/stationary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace camvox::lidar {
namespace {

/// Median of image / reference over the blocks: the gain between two exposures of one scene.
double common_gain(const BlockImage& reference, const BlockImage& image) {
  std::vector<double> ratios;
  ratios.reserve(image.means.size());
  for (std::size_t i = 0; i < image.means.size(); ++i) {
    if (reference.means[i] > 8.0F) {
      ratios.push_back(static_cast<double>(image.means[i] / reference.means[i]));
    }
  }
  if (ratios.empty()) return 1.0;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::ranges::nth_element(ratios, middle);
  return *middle;
}

}  // namespace

bool imu_is_stationary(std::span<const std::array<double, 6>> samples,
                       const StationaryConfig& config) {
  if (samples.size() < kMinStationarySamples) return false;
  const auto count = static_cast<double>(samples.size());
  for (std::size_t axis = 0; axis < 6; ++axis) {
    double sum = 0.0;
    for (const auto& sample : samples) sum += sample[axis];
    const double mean = sum / count;
    double squares = 0.0;
    for (const auto& sample : samples) squares += (sample[axis] - mean) * (sample[axis] - mean);
    const bool gyro = axis < 3;
    const double sigma = std::sqrt(squares / (count - 1.0));
    if (!(sigma <= (gyro ? config.max_gyro_sigma_rad_s : config.max_force_sigma_m_s2)))
      return false;
    if (gyro && std::abs(mean) > config.max_gyro_mean_rad_s) return false;
  }
  return true;
}

BlockImage block_means(const std::uint8_t* grey,
                       std::size_t width_px,
                       std::size_t height_px,
                       std::size_t row_step_bytes) {
  BlockImage image;
  image.columns = width_px / kBlock_px;
  const std::size_t rows = height_px / kBlock_px;
  image.means.resize(image.columns * rows);
  // Every fourth row of a block is enough: 64 pixels bring the noise down to an eighth.
  constexpr std::size_t kRowStride = 4;
  constexpr float kPerPixel = static_cast<float>(kRowStride) / (kBlock_px * kBlock_px);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < image.columns; ++column) {
      unsigned sum = 0;
      for (std::size_t line = kRowStride / 2; line < kBlock_px; line += kRowStride) {
        const auto* pixel = grey + (row * kBlock_px + line) * row_step_bytes + column * kBlock_px;
        for (std::size_t i = 0; i < kBlock_px; ++i) sum += pixel[i];
      }
      image.means[row * image.columns + column] = static_cast<float>(sum) * kPerPixel;
    }
  }
  return image;
}

double changed_blocks(const BlockImage& reference,
                      const BlockImage& image,
                      const StationaryConfig& config) {
  const bool comparable =
      reference.columns == image.columns && reference.means.size() == image.means.size();
  if (!comparable || image.means.empty()) return 1.0;
  const double gain = common_gain(reference, image);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < image.means.size(); ++i) {
    const double change =
        static_cast<double>(image.means[i]) - gain * static_cast<double>(reference.means[i]);
    changed += std::abs(change) > config.max_block_change ? 1 : 0;
  }
  return static_cast<double>(changed) / static_cast<double>(image.means.size());
}

StationaryDetector::StationaryDetector(const StationaryConfig& config) : config_(config) {
  config::require_valid(config, "stationary");
}

bool StationaryDetector::add(BlockImage image, std::span<const std::array<double, 6>> imu) {
  const bool same_view = changed_blocks(reference_, image, config_) <= config_.max_changed_blocks;
  if (!imu_is_stationary(imu, config_) || !same_view) {
    reference_ = std::move(image);
    still_frames_ = 0;
    return false;
  }
  return ++still_frames_ >= config_.min_still_frames;
}

}  // namespace camvox::lidar
