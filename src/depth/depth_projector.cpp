#include "camvox/depth/depth_projector.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "camvox/config/target_clones.hpp"
#include "cell_grid.hpp"
#include "hidden_returns.hpp"
#include "mixed_cell.hpp"
#include "plane_map.hpp"
#include "point_projection.hpp"

namespace camvox::depth {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

NoiseModel make_noise(const sensors::CameraModel& camera, const DepthProjectorConfig& config) {
  const double focal = std::sqrt(camera.intrinsics().fx_px * camera.intrinsics().fy_px);
  return {config.range_sigma_m,
          config.angle_sigma_deg * kDegree * focal,
          config.extrinsics_sigma_deg * kDegree * focal,
          config.extrinsics_sigma_m,
          focal};
}

ProjectionBounds make_bounds(const DepthProjectorConfig& config) {
  return {static_cast<float>(config.min_range_m),
          static_cast<float>(config.max_range_m),
          static_cast<float>(kMargin * kCell)};
}

MixedCellRule make_rule(const DepthProjectorConfig& config) {
  return {static_cast<float>(config.fill_reach_px),
          static_cast<float>(config.near_margin_px),
          static_cast<float>(config.far_margin_px),
          static_cast<float>(config.surface_gap),
          static_cast<float>(config.max_roughness),
          static_cast<float>(1.0 / config.max_range_m)};
}

/// The pixels of a cell that lie in the image, and where.
struct Block {
  float* depth_m;
  float* sigma_m;
  std::size_t stride;
  int width;
  int height;
};

CAMVOX_ALWAYS_INLINE void write_plane_row(
    const CellPlane& plane, int v, int width, float* depth_m, float* sigma_m) {
  const float rho_row = plane.rho + plane.slope_v * (static_cast<float>(v) - 0.5F * (kCell - 1));
  for (int u = 0; u < width; ++u) {
    const float rho = rho_row + plane.slope_u * (static_cast<float>(u) - 0.5F * (kCell - 1));
    const float z = 1.0F / rho;
    depth_m[u] = z;
    sigma_m[u] = plane.sigma_rho * z * z;
  }
}

CAMVOX_TARGET_CLONES
void write_plane(const CellPlane& plane, const Block& block) {
  for (int v = 0; v < block.height; ++v) {
    float* depth_m = block.depth_m + static_cast<std::size_t>(v) * block.stride;
    float* sigma_m = block.sigma_m + static_cast<std::size_t>(v) * block.stride;
    if (block.width == kCell) {  // With a length that the compiler knows it is a few instructions.
      write_plane_row(plane, v, kCell, depth_m, sigma_m);
    } else {
      write_plane_row(plane, v, block.width, depth_m, sigma_m);
    }
  }
}

std::size_t write_pixels(const CellPixels& pixels, const Block& block) {
  std::size_t filled = 0;
  for (int v = 0; v < block.height; ++v) {
    const auto to = static_cast<std::size_t>(v) * block.stride;
    const float* depth_m = &pixels.depth_m[static_cast<std::size_t>(v * kCell)];
    const float* sigma_m = &pixels.sigma_m[static_cast<std::size_t>(v * kCell)];
    std::copy(depth_m, depth_m + block.width, block.depth_m + to);
    std::copy(sigma_m, sigma_m + block.width, block.sigma_m + to);
    for (int u = 0; u < block.width; ++u) filled += static_cast<std::size_t>(depth_m[u] > 0.0F);
  }
  return filled;
}

void clear(const Block& block) {
  for (int v = 0; v < block.height && block.width > 0; ++v) {
    const auto to = static_cast<std::size_t>(v) * block.stride;
    std::fill_n(block.depth_m + to, block.width, 0.0F);
    std::fill_n(block.sigma_m + to, block.width, 0.0F);
  }
}

/// The plane stays well in front of the camera, and within the largest depth, over the whole cell.
bool is_usable(const CellPlane& plane, float least_rho) {
  const float change = 0.5F * kCell * (std::abs(plane.slope_u) + std::abs(plane.slope_v));
  return plane.rho > 0.0F && change < 0.5F * plane.rho && plane.rho - change > least_rho;
}

}  // namespace

struct DepthProjector::Implementation {
  Implementation(const sensors::CameraModel& camera, const DepthProjectorConfig& given)
      : config(given),
        width_px(camera.intrinsics().width_px),
        height_px(camera.intrinsics().height_px),
        noise(make_noise(camera, given)),
        projection(camera, make_bounds(given)),
        grid(width_px, height_px),
        planes(camera) {}

  std::size_t write(std::span<float> depth_m, std::span<float> sigma_m) {
    const MixedCellRule mixed = make_rule(config);
    MixedCellFiller filler(mixed, noise);
    CellPixels pixels;
    std::size_t filled = 0;
    for (int row = kMargin; row < grid.rows() - kMargin; ++row) {
      Block empty = block_at(0, row, depth_m, sigma_m);  // Grows until a cell with depth follows.
      empty.width = 0;
      for (int column = kMargin; column < grid.columns() - kMargin; ++column) {
        const Block block = block_at(column - kMargin, row, depth_m, sigma_m);
        const std::size_t cell = grid.cell(column, row);
        const bool plane =
            planes.kind(cell) == CellKind::kPlane && is_usable(planes.plane(cell), mixed.least_rho);
        if (!plane && !filler.fill(grid, planes, column, row, pixels)) {
          if (empty.width == 0)
            empty = block;
          else
            empty.width += block.width;
          continue;
        }
        clear(empty);
        empty.width = 0;
        if (plane) {
          write_plane(planes.plane(cell), block);
          filled += static_cast<std::size_t>(block.width * block.height);
        } else {
          filled += write_pixels(pixels, block);
        }
      }
      clear(empty);
    }
    return filled;
  }

  /// The pixels of a cell, counted from the image's left border.
  [[nodiscard]] Block block_at(int column,
                               int row,
                               std::span<float> depth_m,
                               std::span<float> sigma_m) const {
    const auto stride = static_cast<std::size_t>(width_px);
    const int u = column * kCell;
    const int v = (row - kMargin) * kCell;
    const auto offset = static_cast<std::size_t>(v) * stride + static_cast<std::size_t>(u);
    return {&depth_m[offset],
            &sigma_m[offset],
            stride,
            std::min(kCell, width_px - u),
            std::min(kCell, height_px - v)};
  }

  DepthProjectorConfig config;
  int width_px;
  int height_px;
  NoiseModel noise;
  PointProjection projection;
  CellGrid grid;
  PlaneMap planes;
  ProjectedPoints points;
  std::vector<std::uint8_t> hidden;
};

DepthProjector::DepthProjector(const sensors::CameraModel& camera,
                               const DepthProjectorConfig& config) {
  config::require_valid(config, "depth");
  implementation_ = std::make_unique<Implementation>(camera, config);
}
DepthProjector::~DepthProjector() = default;
DepthProjector::DepthProjector(DepthProjector&&) noexcept = default;
DepthProjector& DepthProjector::operator=(DepthProjector&&) noexcept = default;

ProjectionReport DepthProjector::project(std::span<const ScanView> scans,
                                         std::span<float> depth_m,
                                         std::span<float> sigma_m) {
  Implementation& self = *implementation_;
  const auto pixels =
      static_cast<std::size_t>(self.width_px) * static_cast<std::size_t>(self.height_px);
  if (depth_m.size() != pixels || sigma_m.size() != pixels) {
    throw std::logic_error("DepthProjector: the images must have the size of the camera's");
  }
  ProjectionReport report;
  self.points.resize(0);
  for (const ScanView& scan : scans) {
    report.returns += scan.points_lidar.size() / 4;
    self.projection.append(scan.points_lidar, scan.T_camera_lidar, self.points);
  }
  report.projected = self.points.size();
  self.grid.assign(self.points);
  self.planes.fit(self.grid, self.noise);
  const OcclusionRule rule{.surface_gap = static_cast<float>(self.config.surface_gap)};
  report.hidden = find_hidden(self.planes, rule, self.grid, self.hidden);
  if (report.hidden > 0) {
    self.planes.refit(self.grid, self.noise, self.grid.remove(self.hidden));
  }
  self.planes.drop_unsupported(self.grid);
  report.filled_px = self.write(depth_m, sigma_m);
  return report;
}

void DepthProjector::set_extrinsics_sigma(double rotation_rad, double translation_m) {
  implementation_->noise.extrinsics_sigma_px = rotation_rad * implementation_->noise.focal_px;
  implementation_->noise.extrinsics_sigma_m = translation_m;
}

}  // namespace camvox::depth
