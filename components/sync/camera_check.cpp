#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "camvox/sync_component/image_input.hpp"

namespace camvox::sync_component {

std::string camera_mismatch(const sensor_msgs::msg::CameraInfo& info,
                            const sensors::CameraIntrinsics& camera) {
  if (static_cast<int>(info.width()) != camera.width_px ||
      static_cast<int>(info.height()) != camera.height_px) {
    return fmt::format("the driver's camera has {}x{} pixels, the configured one {}x{}",
                       info.width(),
                       info.height(),
                       camera.width_px,
                       camera.height_px);
  }
  if (info.k()[0] == 0.0) return {};  // an uncalibrated driver says nothing
  const std::vector<std::pair<const char*, std::pair<double, double>>> numbers = {
      {"fx", {info.k()[0], camera.fx_px}},
      {"fy", {info.k()[4], camera.fy_px}},
      {"cx", {info.k()[2], camera.cx_px}},
      {"cy", {info.k()[5], camera.cy_px}},
  };
  constexpr double kTolerance_px = 0.1;
  for (const auto& [name, values] : numbers) {
    if (std::abs(values.first - values.second) > kTolerance_px) {
      return fmt::format("the driver's camera has {} {:.3f} px, the configured one {:.3f} px",
                         name,
                         values.first,
                         values.second);
    }
  }
  if (!info.distortion_model().empty() && info.distortion_model() != camera.distortion_model) {
    return fmt::format("the driver's camera has lens model {}, the configured one {}",
                       info.distortion_model(),
                       camera.distortion_model);
  }
  constexpr double kTolerance = 1e-4;
  const auto at = [](const auto& list, std::size_t i) { return i < list.size() ? list[i] : 0.0; };
  for (std::size_t i = 0; i < std::max(info.d().size(), camera.distortion.size()); ++i) {
    if (std::abs(at(info.d(), i) - at(camera.distortion, i)) > kTolerance) {
      return fmt::format("the driver's camera has distortion[{}] {:.6f}, the configured one {:.6f}",
                         i,
                         at(info.d(), i),
                         at(camera.distortion, i));
    }
  }
  return {};
}

}  // namespace camvox::sync_component
