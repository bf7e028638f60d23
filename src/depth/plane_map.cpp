#include "plane_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace camvox::depth {
namespace {

/// Fewer returns do not prove a plane.
constexpr double kLeastReturns = 6.0;
constexpr double kLeastReturnsAlone = 8.0;
/// The cell's middle is at most this far (squared, in standard deviations) from the mean of the
/// returns: returns on half of the window only have it at 1.7.
constexpr double kMostOffCentre2 = 1.0;

/// Of a cell with a plane and no, one, or more returns of its own, and its eight neighbours, at
/// least so many have a plane.
constexpr std::array<int, 3> kLeastPlanes = {6, 5, 3};

using Moment = CellGrid::Moment;

bool is_plane(const PlaneFit& fit, double least) {
  return fit.count >= least && fit.off_centre2 <= kMostOffCentre2 &&
         (agrees_with_noise(fit) || is_even(fit));
}

CellPlane to_plane(const PlaneFit& fit) {
  return {static_cast<float>(fit.rho),
          static_cast<float>(fit.slope_u),
          static_cast<float>(fit.slope_v),
          static_cast<float>(std::sqrt(fit.variance))};
}

}  // namespace

struct PlaneMap::Row {
  explicit Row(std::size_t columns) {
    for (auto& list : window) list.resize(columns);
    column.resize(columns);
    planes.resize(columns);
    accepted.resize(columns);
  }
  std::array<std::vector<double>, CellGrid::kMoments> window;
  std::vector<double> column;  ///< Sums over three cells, one above the other.
  std::vector<CellPlane> planes;
  std::vector<int> accepted;
};

PlaneMap::PlaneMap(const sensors::CameraModel& camera) {
  const auto& intrinsics = camera.intrinsics();
  const CellGrid grid(intrinsics.width_px, intrinsics.height_px);
  columns_ = grid.columns();
  rows_ = grid.rows();
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  kinds_.resize(cells, CellKind::kMixed);
  planes_.resize(cells);
  cosines_.resize(cells, 1.0F);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const auto view = camera.unproject({middle_px(column), middle_px(row)});
      if (view.converged) cosines_[grid.cell(column, row)] = static_cast<float>(view.f_camera.z());
    }
  }
}

CAMVOX_TARGET_CLONES
void PlaneMap::fit_windows(const CellGrid& grid,
                           int row,
                           const NoiseModel& noise,
                           Row& fits) const {
  const auto stride = static_cast<std::size_t>(columns_);
  const std::size_t first = grid.cell(0, row);
  for (std::size_t m = 0; m < CellGrid::kMoments; ++m) {
    const double* centre = grid.sums(static_cast<Moment>(m)) + first;
    const double* above = centre - stride;
    const double* below = centre + stride;
    double* window = fits.window[m].data();
    double* three = fits.column.data();
    for (std::size_t c = 0; c < stride; ++c) three[c] = above[c] + centre[c] + below[c];
    for (std::size_t c = 1; c + 1 < stride; ++c) window[c] = three[c - 1] + three[c] + three[c + 1];
  }
  const NoiseModel local = noise;
  const double v_c = middle_px(row);
  const float* cosines = &cosines_[first];
  CellPlane* planes = fits.planes.data();
  int* accepted = fits.accepted.data();
  const double* w[CellGrid::kMoments];
  for (std::size_t m = 0; m < CellGrid::kMoments; ++m) w[m] = fits.window[m].data();
  for (int c = kMargin; c < columns_ - kMargin; ++c) {
    const double moments[CellGrid::kMoments] = {
        w[0][c], w[1][c], w[2][c], w[3][c], w[4][c], w[5][c], w[6][c], w[7][c], w[8][c], w[9][c]};
    const double u_c = static_cast<double>(kCell * (c - kMargin)) + 0.5 * (kCell - 1);
    const PlaneFit fit = fit_plane(moments, u_c, v_c, cosines[c], local);
    planes[c].rho = static_cast<float>(fit.rho);
    planes[c].slope_u = static_cast<float>(fit.slope_u);
    planes[c].slope_v = static_cast<float>(fit.slope_v);
    planes[c].sigma_rho = static_cast<float>(std::sqrt(fit.variance));
    accepted[c] = static_cast<int>(fit.count >= kLeastReturns) &
                  static_cast<int>(fit.off_centre2 <= kMostOffCentre2) &
                  (static_cast<int>(agrees_with_noise(fit)) | static_cast<int>(is_even(fit)));
  }
}

bool PlaneMap::try_cell_alone(const CellGrid& grid, int column, int row, const NoiseModel& noise) {
  const std::size_t cell = grid.cell(column, row);
  if (grid.sums(CellGrid::kN)[cell] < kLeastReturnsAlone) return false;
  const auto moments = grid.window(cell, 0);
  const PlaneFit fit =
      fit_plane(moments.data(), middle_px(column), middle_px(row), cosines_[cell], noise);
  if (!is_plane(fit, kLeastReturnsAlone)) return false;
  planes_[cell] = to_plane(fit);
  return true;
}

void PlaneMap::fit_row(const CellGrid& grid, int row, const NoiseModel& noise, Row& fits) {
  fit_windows(grid, row, noise, fits);
  for (int column = kMargin; column < columns_ - kMargin; ++column) {
    const std::size_t cell = grid.cell(column, row);
    const auto i = static_cast<std::size_t>(column);
    planes_[cell] = fits.planes[i];
    const bool plane = fits.accepted[i] != 0 || try_cell_alone(grid, column, row, noise);
    kinds_[cell] = plane ? CellKind::kPlane : CellKind::kMixed;
  }
}

void PlaneMap::fit(const CellGrid& grid, const NoiseModel& noise) {
  Row fits(static_cast<std::size_t>(columns_));
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    if (grid.has_returns(row - 1) || grid.has_returns(row) || grid.has_returns(row + 1)) {
      fit_row(grid, row, noise, fits);
    } else {
      const auto first = kinds_.begin() + static_cast<std::ptrdiff_t>(grid.cell(0, row));
      std::fill(first, first + columns_, CellKind::kMixed);
    }
  }
}

void PlaneMap::refit_cell(const CellGrid& grid, int column, int row, const NoiseModel& noise) {
  const std::size_t cell = grid.cell(column, row);
  const auto moments = grid.window(cell, 1);
  const PlaneFit fit =
      fit_plane(moments.data(), middle_px(column), middle_px(row), cosines_[cell], noise);
  planes_[cell] = to_plane(fit);
  const bool plane = is_plane(fit, kLeastReturns) || try_cell_alone(grid, column, row, noise);
  kinds_[cell] = plane ? CellKind::kPlane : CellKind::kMixed;
}

void PlaneMap::refit(const CellGrid& grid,
                     const NoiseModel& noise,
                     std::span<const std::size_t> changed) {
  // They lie in the image, so what is around them is within the margin.
  to_refit_.assign(kinds_.size(), 0);
  const auto stride = static_cast<std::size_t>(columns_);
  for (const std::size_t cell : changed) {
    for (std::size_t c = cell - stride; c <= cell + stride; c += stride) {
      to_refit_[c - 1] = to_refit_[c] = to_refit_[c + 1] = 1;
    }
  }
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) {
      if (to_refit_[grid.cell(column, row)] != 0) refit_cell(grid, column, row, noise);
    }
  }
}

void PlaneMap::drop_unsupported(const CellGrid& grid) {
  unsupported_.clear();
  for (int row = kMargin; row < rows_ - kMargin; ++row) {
    for (int column = kMargin; column < columns_ - kMargin; ++column) {
      const std::size_t cell = grid.cell(column, row);
      if (kinds_[cell] != CellKind::kPlane) continue;
      const std::size_t own = std::min<std::size_t>(grid.count(cell, 0), 2);
      if (count_around(cell) < kLeastPlanes[own]) unsupported_.push_back(cell);
    }
  }
  for (const std::size_t cell : unsupported_) kinds_[cell] = CellKind::kMixed;  // At once.
}

}  // namespace camvox::depth
