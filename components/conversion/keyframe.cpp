#include "camvox/conversion/keyframe.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace camvox::conversion {
namespace {

using camvox_interfaces::msg::Keyframe;

void check_counts(const Keyframe& message) {
  const auto count = message.features_count();
  const bool equal = message.depth_count() == count && message.octaves_count() == count &&
                     message.descriptors_count() == count && message.landmark_ids_count() == count;
  if (!equal) {
    throw std::invalid_argument("keyframe " + std::to_string(message.id()) +
                                ": lists of different length");
  }
}

}  // namespace

bool write_features(const features::FrameFeatures& features, Keyframe& message) {
  const auto count = static_cast<std::uint32_t>(features.size());
  const bool fits = features.size() <= camvox_interfaces::msg::KEYFRAME_FEATURES;
  for (std::uint32_t i = 0; fits && i < count; ++i) {
    const auto& point = features.key_points[i];
    const auto& undistorted = features.undistorted_px[i];
    message.features()[i] = {
        point.u_px, point.v_px, undistorted.x(), undistorted.y(), point.angle_rad, point.response};
    message.depth()[i] = {features.depth_m[i], features.depth_sigma_m[i]};
    message.octaves()[i] = point.octave;
    message.descriptors()[i] = features.descriptors[i].bytes;
    message.landmark_ids()[i] = 0;
  }
  const std::uint32_t written = fits ? count : 0;
  message.features_count(written);
  message.depth_count(written);
  message.octaves_count(written);
  message.descriptors_count(written);
  message.landmark_ids_count(written);
  return fits;
}

features::FrameFeatures read_features(const Keyframe& message) {
  check_counts(message);
  const std::size_t count = message.features_count();
  features::FrameFeatures features;
  features.key_points.reserve(count);
  features.undistorted_px.reserve(count);
  features.descriptors.reserve(count);
  features.depth_m.reserve(count);
  features.depth_sigma_m.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto& row = message.features()[i];
    const auto& depth = message.depth()[i];
    const auto finite = [](float value) { return std::isfinite(value); };
    if (!std::all_of(row.begin(), row.end(), finite) ||
        !std::all_of(depth.begin(), depth.end(), finite)) {
      throw std::invalid_argument("keyframe " + std::to_string(message.id()) + ": feature " +
                                  std::to_string(i) + " is not finite");
    }
    features.key_points.push_back({row[0], row[1], row[4], row[5], message.octaves()[i]});
    features.undistorted_px.emplace_back(row[2], row[3]);
    features.descriptors.push_back({message.descriptors()[i]});
    features.depth_m.push_back(depth[0]);
    features.depth_sigma_m.push_back(depth[1]);
  }
  return features;
}

}  // namespace camvox::conversion
