#include "camvox/sync_component/depth_input.hpp"

#include <fmt/format.h>

#include <cstring>

namespace camvox::sync_component {
namespace {

/// Depth and sigma of one row. NaN fails both comparisons, so it becomes 0.
void write_row(const float* z_m,
               std::size_t count,
               const DepthInputConfig& config,
               float* depth_m,
               float* sigma_m) {
  const auto min_m = static_cast<float>(config.min_depth_m);
  const auto max_m = static_cast<float>(config.max_depth_m);
  const auto base_m = static_cast<float>(config.sigma_base_m);
  const auto growth = static_cast<float>(config.sigma_quadratic);
  const auto nearest_m = static_cast<float>(config.sigma_nearest_m);
  for (std::size_t i = 0; i < count; ++i) {
    const float z = z_m[i];
    const bool valid = z > 0.0F && z >= min_m && z <= max_m;
    const float beyond_m = z - nearest_m;
    depth_m[i] = valid ? z : 0.0F;
    sigma_m[i] = valid ? base_m + growth * beyond_m * beyond_m : 0.0F;
  }
}

}  // namespace

std::string read_depth(const sensor_msgs::msg::Image& image,
                       const sensors::CameraIntrinsics& camera,
                       const DepthInputConfig& config,
                       camvox_interfaces::msg::DepthImage& depth) {
  const bool millimetres = image.encoding() == "16UC1" || image.encoding() == "mono16";
  if (!millimetres && image.encoding() != "32FC1") {
    return fmt::format("has encoding '{}', depth is 16UC1 or 32FC1", image.encoding());
  }
  const std::size_t width = image.width(), height = image.height();
  if (static_cast<int>(width) != camera.width_px || static_cast<int>(height) != camera.height_px) {
    return fmt::format("is {}x{}, the camera has {}x{}; register depth to colour first",
                       width,
                       height,
                       camera.width_px,
                       camera.height_px);
  }
  if (width * height > depth.depth_m().size()) return "has more pixels than a depth image holds";
  const std::size_t row_bytes = width * (millimetres ? 2 : 4);
  if (image.step() < row_bytes || image.data().size() < image.step() * (height - 1) + row_bytes) {
    return "has fewer bytes than its size says";
  }
  if (image.is_bigendian() != 0) return "is big-endian";
  std::vector<float> row_m(width);
  std::vector<std::uint16_t> row_mm(millimetres ? width : 0);
  for (std::size_t v = 0; v < height; ++v) {
    const auto* row = image.data().data() + v * image.step();
    if (millimetres) {
      std::memcpy(row_mm.data(), row, row_bytes);
      for (std::size_t u = 0; u < width; ++u) row_m[u] = 0.001F * static_cast<float>(row_mm[u]);
    } else {
      std::memcpy(row_m.data(), row, row_bytes);
    }
    const std::size_t first = v * width;
    write_row(row_m.data(), width, config, &depth.depth_m()[first], &depth.sigma_m()[first]);
  }
  depth.width_px(image.width());
  depth.height_px(image.height());
  depth.depth_m_count(static_cast<std::uint32_t>(width * height));
  depth.sigma_m_count(static_cast<std::uint32_t>(width * height));
  return {};
}

}  // namespace camvox::sync_component
