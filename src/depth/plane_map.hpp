#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "camvox/sensors/camera_model.hpp"
#include "cell_grid.hpp"
#include "plane_fit.hpp"

namespace camvox::depth {

/// How a cell of the image gets its depth.
enum class CellKind : std::uint8_t {
  kPlane,  ///< All returns around agree on one plane, and surround the cell.
  kMixed,  ///< To be looked at return by return.
};

/// What a plane says of a cell's pixels: inverse depth at the cell's middle, its slope, and sigma.
struct CellPlane {
  float rho = 0.0F;
  float slope_u = 0.0F;
  float slope_v = 0.0F;
  float sigma_rho = 0.0F;
};

/// One plane for every cell of the image, as far as there is one.
class PlaneMap {
 public:
  explicit PlaneMap(const sensors::CameraModel& camera);

  /// Fits all cells.
  void fit(const CellGrid& grid, const NoiseModel& noise);
  /// Fits those again that the returns of `changed` cells count for.
  void refit(const CellGrid& grid, const NoiseModel& noise, std::span<const std::size_t> changed);

  /// Takes the plane from cells that stand in for a gap in the scan: few returns of their own, and
  /// neighbours without a plane. What lies in such a gap is often nearer, and not to be seen
  /// through.
  void drop_unsupported(const CellGrid& grid);

  [[nodiscard]] CellKind kind(std::size_t cell) const { return kinds_[cell]; }
  [[nodiscard]] const CellPlane& plane(std::size_t cell) const { return planes_[cell]; }

  /// How many of the cell and its neighbours have a plane.
  [[nodiscard]] int count_around(std::size_t cell) const {
    const auto stride = static_cast<std::size_t>(columns_);
    int count = 0;
    for (std::size_t row = cell - stride; row <= cell + stride; row += stride) {
      for (std::size_t c = row - 1; c <= row + 1; ++c) {
        count += static_cast<int>(kinds_[c] == CellKind::kPlane);
      }
    }
    return count;
  }

  /// Middle of a column or row of cells, and the cosine of a cell's direction to the optical axis.
  [[nodiscard]] static float middle_px(int column_or_row) {
    return static_cast<float>(kCell * (column_or_row - kMargin)) + 0.5F * (kCell - 1);
  }
  [[nodiscard]] float cosine(std::size_t cell) const { return cosines_[cell]; }

 private:
  /// The fits of one row of cells, a list for each field of PlaneFit that is looked at.
  struct Row;
  void fit_row(const CellGrid& grid, int row, const NoiseModel& noise, Row& fits);
  void fit_windows(const CellGrid& grid, int row, const NoiseModel& noise, Row& fits) const;
  void refit_cell(const CellGrid& grid, int column, int row, const NoiseModel& noise);
  [[nodiscard]] bool try_cell_alone(const CellGrid& grid, int column, int row, const NoiseModel&);

  int columns_;
  int rows_;
  std::vector<float> cosines_;
  std::vector<CellKind> kinds_;
  std::vector<std::size_t> unsupported_;
  std::vector<std::uint8_t> to_refit_;
  std::vector<CellPlane> planes_;
};

}  // namespace camvox::depth
