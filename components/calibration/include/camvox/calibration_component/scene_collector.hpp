#pragma once

#include <cstdint>
#include <optional>

#include "camvox/calibration/scene.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"

namespace camvox::calibration_component {

/// Gathers what a calibration needs of one standstill: the first usable image, and the returns of
/// all clouds (lidar frame, m), as many as memory allows.
class SceneCollector {
 public:
  /// Image and cloud of one frame. One from before the first begins anew: the clock was set back.
  void add(const camvox_interfaces::msg::FrameImage& image,
           const camvox_interfaces::msg::Cloud& cloud);
  void clear() { *this = {}; }

  /// An image is there, and returns of at least this long.
  [[nodiscard]] bool is_complete(double collect_s) const;
  /// The scene; the next one begins empty.
  [[nodiscard]] calibration::Scene take();

 private:
  calibration::Scene scene_;
  std::optional<std::int64_t> first_ns_;
  std::int64_t last_ns_ = 0;
};

}  // namespace camvox::calibration_component
