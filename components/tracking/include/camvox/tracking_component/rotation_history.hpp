#pragma once

#include <cstdint>
#include <map>
#include <optional>

#include "camvox/geometry/so3.hpp"

namespace camvox::tracking_component {

/// What the gyro said of the rotation from each frame to the one before, also of frames that were
/// never tracked: so the rotation over a gap is known as long as no frame's is missing.
class RotationHistory {
 public:
  static constexpr std::size_t kCapacity = 64;

  void add(std::uint64_t frame_id, const geometry::SO3& R_previous_camera);

  /// From frame `to` to the earlier frame `from`; nothing when a frame between them said nothing.
  [[nodiscard]] std::optional<geometry::SO3> between(std::uint64_t from, std::uint64_t to) const;

 private:
  std::map<std::uint64_t, geometry::SO3> rotations_;
};

}  // namespace camvox::tracking_component
