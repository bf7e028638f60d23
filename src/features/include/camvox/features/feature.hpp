#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace camvox::features {

/// A corner found in the (distorted) image. Pixel centres have integer coordinates.
struct KeyPoint {
  float u_px = 0.0F;        ///< Column in the full-size image.
  float v_px = 0.0F;        ///< Row in the full-size image.
  float angle_rad = 0.0F;   ///< Orientation in [0, 2 pi), from the x axis towards the y axis.
  float response = 0.0F;    ///< Strength of the corner; only comparable within one image.
  std::uint8_t octave = 0;  ///< Pyramid level that it was found on; 0 is the full-size image.
};

/// 256 binary comparisons; alignment lets the Hamming distance read whole words.
struct alignas(8) Descriptor {
  std::array<std::uint8_t, 32> bytes{};

  bool operator==(const Descriptor&) const = default;
};

/// All features of one image, with the depth that lidar (or a depth camera) gives them. Row i of
/// every list is feature i.
struct FrameFeatures {
  std::vector<KeyPoint> key_points;
  std::vector<Eigen::Vector2f> undistorted_px;  ///< On the pinhole with the same fx fy cx cy.
  std::vector<Descriptor> descriptors;
  std::vector<float> depth_m;        ///< z along the optical axis; 0: none.
  std::vector<float> depth_sigma_m;  ///< Standard deviation of depth_m.

  [[nodiscard]] std::size_t size() const { return key_points.size(); }
};

}  // namespace camvox::features
