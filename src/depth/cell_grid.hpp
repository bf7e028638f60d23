#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
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

  /// The sums over `count` returns.
  [[nodiscard]] static Moments sum(const float* u_px,
                                   const float* v_px,
                                   const float* rho,
                                   std::size_t count);

  CellGrid(int width_px, int height_px);

  void assign(const ProjectedPoints& points);

  /// Takes returns out (`removed`: one entry a return, 0: stays). Returns the cells they were in.
  std::vector<std::size_t> remove(std::span<const std::uint8_t> removed);

  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] std::size_t cell(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }
  /// Returns of the cells `first` to `last` of one row are begin(first) to end(last).
  [[nodiscard]] std::size_t begin(std::size_t cell) const { return starts_[cell]; }
  [[nodiscard]] std::size_t end(std::size_t cell) const { return starts_[cell + 1]; }

  /// Returns in the cells at most `radius` away; the caller stays that far from the border.
  [[nodiscard]] std::size_t count(std::size_t cell, std::size_t radius) const {
    const std::size_t way = radius * static_cast<std::size_t>(columns_);
    std::size_t count = 0;
    for (std::size_t c = cell - way; c <= cell + way; c += static_cast<std::size_t>(columns_)) {
      count += starts_[c + radius + 1] - starts_[c - radius];
    }
    return count;
  }
  [[nodiscard]] bool has_returns(int row) const {
    return begin(cell(0, row)) != end(cell(columns_ - 1, row));
  }

  [[nodiscard]] const ProjectedPoints& points() const { return sorted_; }
  [[nodiscard]] const double* sums(Moment moment) const { return sums_[moment].data(); }
  /// Sums over the cells at most `radius` away; the caller stays that far from the border.
  [[nodiscard]] Moments window(std::size_t cell, int radius) const;
  /// Largest inverse depth of a cell's returns; 0: it has none.
  [[nodiscard]] float nearest(std::size_t cell) const { return nearest_[cell]; }

 private:
  void sum(std::size_t cell);

  int columns_;
  int rows_;
  std::vector<std::uint32_t> cell_of_;  ///< Of the returns as given.
  std::vector<std::uint32_t> starts_;   ///< First return of every cell, and the end.
  std::vector<std::uint32_t> next_;
  ProjectedPoints sorted_;
  std::array<std::vector<double>, kMoments> sums_;
  std::vector<float> nearest_;
};

}  // namespace camvox::depth
