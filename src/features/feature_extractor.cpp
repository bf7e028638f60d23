#include "camvox/features/feature_extractor.hpp"

#include <cmath>
#include <stdexcept>

#include "camvox/features/orientation.hpp"

namespace camvox::features {
namespace {

const ExtractorConfig& checked(const ExtractorConfig& config) {
  config::require_valid(config, "extractor");
  return config;
}

}  // namespace

FeatureExtractor::FeatureExtractor(const ExtractorConfig& config)
    : config_(checked(config)),
      pyramid_(config.levels, config.scale_factor),
      detector_(config.corner_threshold, config.low_threshold),
      distribution_(config.even_share) {}

int FeatureExtractor::budget(int level, int left) const {
  // Levels 0 to `level` share what is left in a geometric series, as their sizes fall.
  const double ratio = 1.0 / config_.scale_factor;
  const double series = (1.0 - std::pow(ratio, level + 1)) / (1.0 - ratio);
  return static_cast<int>(std::lround(left * std::pow(ratio, level) / series));
}

void FeatureExtractor::describe_level(int level, FrameFeatures& features) const {
  const ImageView& image = pyramid_.level(level);
  const auto scale = static_cast<float>(pyramid_.scale(level));
  for (const Corner& corner : chosen_) {
    const Shift shift = refine_corner(image, corner);
    KeyPoint key_point;
    key_point.u_px = (static_cast<float>(corner.u_px) + shift.du_px + 0.5F) * scale - 0.5F;
    key_point.v_px = (static_cast<float>(corner.v_px) + shift.dv_px + 0.5F) * scale - 0.5F;
    key_point.angle_rad = orientation_rad(image, corner.u_px, corner.v_px);
    key_point.response = corner.score;
    key_point.octave = static_cast<std::uint8_t>(level);
    features.key_points.push_back(key_point);
    features.descriptors.push_back(
        descriptor_extractor_.describe(image, corner.u_px, corner.v_px, key_point.angle_rad));
  }
}

void FeatureExtractor::extract(const ImageView& image, FrameFeatures& features) {
  constexpr int kMaxSide_px = 65535;  // corners have 16-bit places
  const bool valid = image.width_px >= 0 && image.height_px >= 0 && image.width_px <= kMaxSide_px &&
                     image.height_px <= kMaxSide_px && image.step_bytes >= image.width_px;
  if (!valid) throw std::logic_error("image view without a valid size");
  features.key_points.clear();
  features.descriptors.clear();
  features.undistorted_px.clear();
  features.depth_m.clear();
  features.depth_sigma_m.clear();
  pyramid_.build(image);
  // From coarse to fine: what a level cannot give, the finer ones have to spare.
  int left = config_.features;
  for (int level = config_.levels - 1; level >= 0; --level) {
    detector_.detect(pyramid_.level(level), corners_);
    distribution_.choose(corners_, budget(level, left), chosen_);
    left -= static_cast<int>(chosen_.size());
    describe_level(level, features);
  }
}

FrameFeatures FeatureExtractor::extract(const ImageView& image) {
  FrameFeatures features;
  extract(image, features);
  return features;
}

}  // namespace camvox::features
