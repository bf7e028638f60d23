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
  nearest_.resize(cells);
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
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place = next_[cell_of_[i]]++;
    sorted_.u_px[place] = points.u_px[i];
    sorted_.v_px[place] = points.v_px[i];
    sorted_.rho[place] = points.rho[i];
    sorted_.shift_u_px[place] = points.shift_u_px[i];
    sorted_.shift_v_px[place] = points.shift_v_px[i];
  }
  for (std::size_t c = 0; c + 1 < starts_.size(); ++c) sum(c);
}

CellGrid::Moments CellGrid::sum(const float* u_px,
                                const float* v_px,
                                const float* rho,
                                std::size_t count) {
  // One variable each: in an array they would go through memory with every return.
  double su = 0.0, sv = 0.0, sr = 0.0, suu = 0.0, suv = 0.0, svv = 0.0, sur = 0.0, svr = 0.0,
         srr = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = u_px[i];
    const double v = v_px[i];
    const double r = rho[i];
    su += u;
    sv += v;
    sr += r;
    suu += u * u;
    suv += u * v;
    svv += v * v;
    sur += u * r;
    svr += v * r;
    srr += r * r;
  }
  return {static_cast<double>(count), su, sv, sr, suu, suv, svv, sur, svr, srr};
}

void CellGrid::sum(std::size_t cell) {
  const std::size_t first = starts_[cell];
  const std::size_t count = starts_[cell + 1] - first;
  const Moments moments = sum(
      sorted_.u_px.data() + first, sorted_.v_px.data() + first, sorted_.rho.data() + first, count);
  for (std::size_t m = 0; m < kMoments; ++m) sums_[m][cell] = moments[m];
  float nearest = 0.0F;
  for (std::size_t i = first; i < first + count; ++i) nearest = std::max(nearest, sorted_.rho[i]);
  nearest_[cell] = nearest;
}

std::vector<std::size_t> CellGrid::remove(std::span<const std::uint8_t> removed) {
  std::vector<std::size_t> changed;
  std::uint32_t kept = 0;
  std::uint32_t begin = 0;
  for (std::size_t c = 0; c + 1 < starts_.size(); ++c) {
    const std::uint32_t end = starts_[c + 1];
    const std::uint32_t start = kept;
    for (std::uint32_t i = begin; i < end; ++i) {
      for (auto* list : sorted_.lists()) (*list)[kept] = (*list)[i];
      kept += static_cast<std::uint32_t>(removed[i] == 0);
    }
    starts_[c] = start;
    if (kept - start != end - begin) {
      starts_[c + 1] = kept;
      sum(c);
      changed.push_back(c);
    }
    begin = end;
  }
  starts_.back() = kept;
  sorted_.resize(kept);
  return changed;
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
