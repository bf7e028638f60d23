#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "point_projection.hpp"

namespace camvox::depth {

/// Side of a cell; a row of its pixels is one vector register.
inline constexpr int kCell = 8;
/// Rings of cells around the image, for returns beside it.
inline constexpr int kMargin = 2;

/// Returns sorted into cells of kCell x kCell pixels (row by row, so that neighbours in a row lie
/// behind each other), and the sums over each cell that plane fits are made of.
class CellGrid {
 public:
  /// Sums over the returns of a cell: count, u, v, rho and their products. Doubles: a far
  /// surface's spread in inverse depth is 1e-11 of its square.
  enum Moment : std::size_t { kN, kU, kV, kR, kUU, kUV, kVV, kUR, kVR, kRR, kMoments };
  using Moments = std::array<double, kMoments>;

  CellGrid(int width_px, int height_px);

  /// Sorts the returns; none is hidden.
  void assign(const ProjectedPoints& points);

  /// Takes a return out of the sums, from now on.
  void hide(std::size_t point);
  [[nodiscard]] bool is_hidden(std::size_t point) const { return hidden_[point] != 0; }

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] std::size_t cell(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  /// Returns of the cells `first` to `last` of one row are begin(first) to end(last).
  [[nodiscard]] std::size_t begin(std::size_t cell) const { return starts_[cell]; }
  [[nodiscard]] std::size_t end(std::size_t cell) const { return starts_[cell + 1]; }

  [[nodiscard]] const ProjectedPoints& points() const { return sorted_; }
  [[nodiscard]] const double* sums(Moment moment) const { return sums_[moment].data(); }
  /// Sums over the cells at most `radius` away; the caller stays that far from the border.
  [[nodiscard]] Moments window(std::size_t cell, int radius) const;

 private:
  void add(std::size_t point, double sign, std::size_t cell);

  int columns_;
  int rows_;
  std::vector<std::uint32_t> cell_of_;  ///< Of the returns as given.
  std::vector<std::uint32_t> starts_;   ///< First return of every cell, and the end.
  std::vector<std::uint32_t> next_;
  ProjectedPoints sorted_;
  std::vector<std::uint8_t> hidden_;
  std::array<std::vector<double>, kMoments> sums_;
};

}  // namespace camvox::depth
