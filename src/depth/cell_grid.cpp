#include "cell_grid.hpp"

#include <algorithm>

namespace camvox::depth {
namespace {

/// Pixel (0, 0) has its centre at 0, its border at -0.5, and is in the first cell after the margin.
constexpr float kOffset_px = 0.5F + static_cast<float>(kMargin * kCell);

}  // namespace

CellGrid::CellGrid(int width_px, int height_px)
    : columns_((width_px + kCell - 1) / kCell + 2 * kMargin),
      rows_((height_px + kCell - 1) / kCell + 2 * kMargin) {
  const auto cells = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  starts_.resize(cells + 1);
  next_.resize(cells);
  for (auto& sums : sums_) sums.resize(cells);
}

void CellGrid::assign(const ProjectedPoints& points) {
  const std::size_t count = points.size();
  cell_of_.resize(count);
  std::fill(starts_.begin(), starts_.end(), 0U);
  for (std::size_t i = 0; i < count; ++i) {
    const int column = static_cast<int>((points.u_px[i] + kOffset_px) * (1.0F / kCell));
    const int row = static_cast<int>((points.v_px[i] + kOffset_px) * (1.0F / kCell));
    cell_of_[i] = static_cast<std::uint32_t>(
        cell(std::clamp(column, 0, columns_ - 1), std::clamp(row, 0, rows_ - 1)));
    ++starts_[cell_of_[i] + 1];
  }
  for (std::size_t i = 1; i < starts_.size(); ++i) starts_[i] += starts_[i - 1];
  std::copy(starts_.begin(), starts_.end() - 1, next_.begin());
  sorted_.resize(count);
  hidden_.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place = next_[cell_of_[i]]++;
    sorted_.u_px[place] = points.u_px[i];
    sorted_.v_px[place] = points.v_px[i];
    sorted_.rho[place] = points.rho[i];
    sorted_.shift_u_px[place] = points.shift_u_px[i];
    sorted_.shift_v_px[place] = points.shift_v_px[i];
  }
  for (auto& sums : sums_) std::fill(sums.begin(), sums.end(), 0.0);
  for (std::size_t c = 0; c + 1 < starts_.size(); ++c) {
    for (std::size_t i = starts_[c]; i < starts_[c + 1]; ++i) add(i, 1.0, c);
  }
}

void CellGrid::add(std::size_t point, double sign, std::size_t cell) {
  const double u = sorted_.u_px[point];
  const double v = sorted_.v_px[point];
  const double r = sorted_.rho[point];
  const double values[kMoments] = {1.0, u, v, r, u * u, u * v, v * v, u * r, v * r, r * r};
  for (std::size_t m = 0; m < kMoments; ++m) sums_[m][cell] += sign * values[m];
}

void CellGrid::hide(std::size_t point) {
  if (hidden_[point] != 0) return;
  hidden_[point] = 1;
  const auto place = std::upper_bound(starts_.begin(), starts_.end(), point);
  add(point, -1.0, static_cast<std::size_t>(place - starts_.begin()) - 1);
}

CellGrid::Moments CellGrid::window(std::size_t cell, int radius) const {
  Moments moments{};
  const auto stride = static_cast<std::size_t>(columns_);
  const auto reach = static_cast<std::size_t>(radius);
  for (std::size_t row = cell - reach * stride; row <= cell + reach * stride; row += stride) {
    for (std::size_t m = 0; m < kMoments; ++m) {
      for (std::size_t c = row - reach; c <= row + reach; ++c) moments[m] += sums_[m][c];
    }
  }
  return moments;
}

}  // namespace camvox::depth
