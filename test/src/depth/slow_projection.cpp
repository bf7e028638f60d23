#include "slow_projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace camvox::test {

using depth::kCell;
using depth::kMargin;
using depth::PlaneMap;

namespace {

float squared(float x) { return x * x; }

depth::CellPlane to_plane(const depth::PlaneFit& fit, double more_variance = 0.0) {
  return {static_cast<float>(fit.rho),
          static_cast<float>(fit.slope_u),
          static_cast<float>(fit.slope_v),
          static_cast<float>(std::sqrt(fit.variance + more_variance))};
}

}  // namespace

SlowProjection::SlowProjection(const sensors::CameraModel& camera,
                               const depth::DepthProjectorConfig& config)
    : camera_(camera), config_(config) {
  const auto& intrinsics = camera.intrinsics();
  const double focal = std::sqrt(intrinsics.fx_px * intrinsics.fy_px);
  const double px_per_deg = focal * std::numbers::pi / 180.0;
  noise_ = {config.range_sigma_m,
            config.angle_sigma_deg * px_per_deg,
            config.extrinsics_sigma_deg * px_per_deg,
            config.extrinsics_sigma_m,
            focal};
  columns_ = (intrinsics.width_px + kCell - 1) / kCell + 2 * kMargin;
  rows_ = (intrinsics.height_px + kCell - 1) / kCell + 2 * kMargin;
}

void SlowProjection::project(const depth::ScanView& scan) {
  const depth::PointProjection projection(camera_,
                                          {static_cast<float>(config_.min_range_m),
                                           static_cast<float>(config_.max_range_m),
                                           static_cast<float>(kMargin * kCell)});
  depth::ProjectedPoints points;
  projection.append(scan.points_lidar, scan.T_camera_lidar, points);
  cells_.assign(static_cast<std::size_t>(columns_ * rows_), {});
  for (std::size_t i = 0; i < points.size(); ++i) {
    const float u = points.u_px[i];
    const float v = points.v_px[i];
    const int column = static_cast<int>((u + 0.5F) / kCell + kMargin);
    const int row = static_cast<int>((v + 0.5F) / kCell + kMargin);
    cell(std::clamp(column, 0, columns_ - 1), std::clamp(row, 0, rows_ - 1))
        .returns.push_back(
            {u, v, points.rho[i], points.shift_u_px[i], points.shift_v_px[i], false});
  }
  fit_cells();
  hide_returns();
  fit_cells();
  drop_unsupported();
  const auto pixels = static_cast<std::size_t>(camera_.intrinsics().width_px) *
                      static_cast<std::size_t>(camera_.intrinsics().height_px);
  depth_m.assign(pixels, 0.0F);
  sigma_m.assign(pixels, 0.0F);
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) fill_cell(column, row);
  }
}

SlowProjection::Returns SlowProjection::around(int column, int row, int radius) {
  Returns found;
  for (int y = row - radius; y <= row + radius; ++y) {
    for (int x = column - radius; x <= column + radius; ++x) {
      for (const Return& p : cell(x, y).returns) {
        if (!p.hidden) found.push_back(p);
      }
    }
  }
  return found;
}

int SlowProjection::planes_around(int column, int row) {
  int count = 0;
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) count += cell(x, y).is_plane ? 1 : 0;
  }
  return count;
}

float SlowProjection::cosine(int column, int row) const {
  const auto view = camera_.unproject({PlaneMap::middle_px(column), PlaneMap::middle_px(row)});
  return view.converged ? static_cast<float>(view.f_camera.z()) : 1.0F;
}

/// About the middle of the cell.
depth::PlaneFit SlowProjection::fit(const Returns& returns, int column, int row) const {
  depth::CellGrid::Moments sums{};
  for (const Return& p : returns) {
    const double u = p.u_px - PlaneMap::middle_px(column);
    const double v = p.v_px - PlaneMap::middle_px(row);
    const double r = p.rho;
    const double values[] = {1.0, u, v, r, u * u, u * v, v * v, u * r, v * r, r * r};
    for (std::size_t k = 0; k < sums.size(); ++k) sums[k] += values[k];
  }
  return depth::fit_plane(sums.data(), 0.0, 0.0, cosine(column, row), noise_);
}

void SlowProjection::fit_cells() {
  const auto accepts = [](const depth::PlaneFit& fit, double least) {
    return fit.count >= least && fit.off_centre2 <= 1.0 &&
           (depth::agrees_with_noise(fit) || depth::is_even(fit));
  };
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) {
      const auto window = fit(around(column, row, 1), column, row);
      const auto alone = fit(around(column, row, 0), column, row);
      Cell& here = cell(column, row);
      here.is_plane = accepts(window, 6.0) || accepts(alone, 8.0);
      here.plane = to_plane(accepts(window, 6.0) ? window : alone);
    }
  }
}

void SlowProjection::hide_returns() {
  const auto hides = [&](const Return& near, const Return& far, float footprint_px) {
    const Eigen::Vector2f shift(far.shift_u_px - near.shift_u_px, far.shift_v_px - near.shift_v_px);
    const Eigen::Vector2f way(far.u_px - near.u_px, far.v_px - near.v_px);
    const float along = way.dot(shift) / shift.norm();
    const float across = way.x() * shift.y() / shift.norm() - way.y() * shift.x() / shift.norm();
    return near.rho * (1.0F - static_cast<float>(config_.surface_gap)) > far.rho &&
           shift.norm() >= 1.0F && along > 0.0F && along < shift.norm() && along <= footprint_px &&
           std::abs(across) <= footprint_px;
  };
  std::vector<Return*> found;
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) {
      if (cell(column, row).is_plane) continue;
      const Returns near = around(column, row, 1);
      const float footprint_px =
          std::clamp(3.0F * kCell / std::sqrt(static_cast<float>(near.size())), 2.0F, 12.0F);
      for (Return& far : cell(column, row).returns) {
        const bool hidden_by_one = std::any_of(
            near.begin(), near.end(), [&](const Return& p) { return hides(p, far, footprint_px); });
        if (hidden_by_one) found.push_back(&far);
      }
    }
  }
  for (Return* far : found) far->hidden = true;
  hidden = static_cast<int>(found.size());
}

void SlowProjection::drop_unsupported() {
  std::vector<Cell*> found;
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) {
      const std::size_t own = around(column, row, 0).size();
      const int least = own == 0 ? 6 : own == 1 ? 5 : 3;
      Cell& here = cell(column, row);
      if (here.is_plane && planes_around(column, row) < least) found.push_back(&here);
    }
  }
  for (Cell* here : found) here->is_plane = false;
}

float SlowProjection::noise_sigma(float rho, float slope2, int column, int row) const {
  const float range = static_cast<float>(config_.range_sigma_m) * cosine(column, row) * rho * rho;
  return std::sqrt(range * range + slope2 * squared(static_cast<float>(noise_.angle_sigma_px)));
}

std::vector<SlowProjection::Surface> SlowProjection::surfaces(int column, int row) {
  Returns left = around(column, row, 1);
  if (left.empty()) return {};
  const int radius = left.size() < 6 ? 2 : 1;
  left = around(column, row, radius);
  reach_px_ = std::min(
      static_cast<float>(config_.fill_reach_px),
      static_cast<float>((2 * radius + 1) * kCell) / std::sqrt(static_cast<float>(left.size())));
  std::vector<depth::CellPlane> planes;
  for (int y = row - 1; y <= row + 1; ++y) {
    for (int x = column - 1; x <= column + 1; ++x) {
      if ((x == column && y == row) || !cell(x, y).is_plane) continue;
      planes.push_back(cell(x, y).plane);
      planes.back().rho -=
          static_cast<float>(kCell) * (static_cast<float>(x - column) * planes.back().slope_u +
                                       static_cast<float>(y - row) * planes.back().slope_v);
    }
  }
  std::vector<Surface> found;
  while (true) {
    Surface best{{}, {}, -1.0F};
    Returns others;
    for (const auto& plane : planes) {
      const float slope2 = squared(plane.slope_u) + squared(plane.slope_v);
      const float bound = 3.5F * noise_sigma(plane.rho, slope2, column, row) + 0.004F * plane.rho;
      Surface surface{{}, plane, -1.0F};
      Returns rest;
      for (const Return& p : left) {
        const float error = p.rho - plane.rho -
                            plane.slope_u * (p.u_px - PlaneMap::middle_px(column)) -
                            plane.slope_v * (p.v_px - PlaneMap::middle_px(row));
        (std::abs(error) < bound ? surface.returns : rest).push_back(p);
      }
      if (surface.returns.size() < 3 || surface.returns.size() <= best.returns.size()) continue;
      best = surface;
      others = rest;
    }
    if (best.returns.empty()) break;
    left = others;
    if (best.returns.size() < 5) {
      found.push_back(best);
    } else if (!add_fit(best.returns, column, row, found)) {
      add_cluster(best.returns, column, row, found);
    }
  }
  add_unexplained(left, column, row, found);
  return found;
}

void SlowProjection::add_unexplained(Returns left,
                                     int column,
                                     int row,
                                     std::vector<Surface>& surfaces) const {
  std::sort(left.begin(), left.end(), [](const auto& a, const auto& b) { return a.rho > b.rho; });
  Returns cluster;
  for (const Return& p : left) {
    if (!cluster.empty()) {
      const float before = cluster.back().rho;
      const float gap = static_cast<float>(config_.surface_gap) * before +
                        3.5F * noise_sigma(before, 0.0F, column, row);
      if (before - p.rho > gap) {
        add_cluster(cluster, column, row, surfaces);
        cluster.clear();
      }
    }
    cluster.push_back(p);
  }
  if (!cluster.empty()) add_cluster(cluster, column, row, surfaces);
}

void SlowProjection::add_cluster(const Returns& returns,
                                 int column,
                                 int row,
                                 std::vector<Surface>& surfaces) const {
  if (returns.size() >= 5 && add_fit(returns, column, row, surfaces)) return;
  const float rho = returns.front().rho;
  const float slope = 2.0F * rho / static_cast<float>(noise_.focal_px);
  const float sigma = std::hypot(noise_sigma(rho, slope * slope, column, row), slope * 1.5F);
  surfaces.push_back({returns, {rho, 0.0F, 0.0F, sigma}, returns.size() == 1 ? 1.5F : -1.0F});
}

bool SlowProjection::add_fit(const Returns& returns,
                             int column,
                             int row,
                             std::vector<Surface>& surfaces) const {
  const depth::PlaneFit plane = fit(returns, column, row);
  const double rough2 = std::max(0.0, plane.sum_squares / plane.count - plane.noise_variance);
  if (!(std::sqrt(rough2) <= config_.max_roughness * plane.rho)) return false;
  surfaces.push_back({returns, to_plane(plane, rough2), reach_px_});
  return true;
}

void SlowProjection::fill_cell(int column, int row) {
  const Cell& here = cell(column, row);
  const float change = 0.5F * kCell * (std::abs(here.plane.slope_u) + std::abs(here.plane.slope_v));
  const bool plane = here.is_plane && here.plane.rho > 0.0F && change < 0.5F * here.plane.rho;
  std::vector<Surface> found;
  if (!plane) {
    if (around(column, row, 0).empty() && planes_around(column, row) < 2) return;
    found = surfaces(column, row);
  }
  const auto& intrinsics = camera_.intrinsics();
  for (int v = (row - kMargin) * kCell; v < (row - kMargin + 1) * kCell; ++v) {
    for (int u = (column - kMargin) * kCell; u < (column - kMargin + 1) * kCell; ++u) {
      if (u >= intrinsics.width_px || v >= intrinsics.height_px) continue;
      if (!plane) {
        fill_pixel(u, v, column, row, found);
        continue;
      }
      const float rho = here.plane.rho +
                        here.plane.slope_u * (static_cast<float>(u) - PlaneMap::middle_px(column)) +
                        here.plane.slope_v * (static_cast<float>(v) - PlaneMap::middle_px(row));
      const auto px = static_cast<std::size_t>(v * intrinsics.width_px + u);
      depth_m[px] = 1.0F / rho;
      sigma_m[px] = here.plane.sigma_rho / (rho * rho);
    }
  }
}

void SlowProjection::fill_pixel(
    int u_px, int v_px, int column, int row, const std::vector<Surface>& surfaces) {
  const auto u = static_cast<float>(u_px);
  const auto v = static_cast<float>(v_px);
  struct Offer {
    float distance_px = std::numeric_limits<float>::infinity();
    float rho = 0.0F;
    bool valid = false;
    float sigma_rho = 0.0F;
  };
  Offer best;
  Offer second;
  for (const Surface& surface : surfaces) {
    Offer offer;
    float low[4], high[4];
    std::fill_n(low, 4, std::numeric_limits<float>::max());
    std::fill_n(high, 4, std::numeric_limits<float>::lowest());
    for (const Return& p : surface.returns) {
      offer.distance_px = std::min(offer.distance_px, std::hypot(p.u_px - u, p.v_px - v));
      const float along[] = {p.u_px, p.v_px, p.u_px + p.v_px, p.u_px - p.v_px};
      for (int k = 0; k < 4; ++k) {
        low[k] = std::min(low[k], along[k] - 1.5F);
        high[k] = std::max(high[k], along[k] + 1.5F);
      }
    }
    offer.rho = surface.plane.rho + surface.plane.slope_u * (u - PlaneMap::middle_px(column)) +
                surface.plane.slope_v * (v - PlaneMap::middle_px(row));
    offer.sigma_rho = std::hypot(surface.plane.sigma_rho, 1e-4F * offer.rho * offer.distance_px);
    offer.valid = offer.distance_px <= surface.reach_px && offer.rho > 0.5F * surface.plane.rho;
    const float here[] = {u, v, u + v, u - v};
    for (int k = 0; k < 4; ++k) offer.valid &= here[k] >= low[k] && here[k] <= high[k];
    if (offer.distance_px < best.distance_px) std::swap(offer, best);
    if (offer.distance_px < second.distance_px) second = offer;
  }
  const double margin_px = second.rho > best.rho ? config_.far_margin_px : config_.near_margin_px;
  if (!best.valid || second.distance_px - best.distance_px < 2.0F * static_cast<float>(margin_px)) {
    return;
  }
  const auto px = static_cast<std::size_t>(v_px * camera_.intrinsics().width_px + u_px);
  depth_m[px] = 1.0F / best.rho;
  sigma_m[px] = best.sigma_rho / (best.rho * best.rho);
}

}  // namespace camvox::test
