#pragma once

#include <vector>

#include "camvox/depth/depth_projector.hpp"
#include "mixed_cell.hpp"
#include "plane_fit.hpp"
#include "point_projection.hpp"

namespace camvox::test {

/// What depth::DepthProjector computes, said as plainly as possible: each cell, return and pixel by
/// itself, nothing skipped, nothing packed. It shares the projection of points and the formulas of
/// the plane fit, which have tests against closed forms; the rest is its own.
class SlowProjection {
 public:
  SlowProjection(const sensors::CameraModel& camera, const depth::DepthProjectorConfig& config);

  void project(const depth::ScanView& scan);

  std::vector<float> depth_m;
  std::vector<float> sigma_m;
  int hidden = 0;

 private:
  struct Return {
    float u_px, v_px, rho, shift_u_px, shift_v_px;
    bool hidden = false;
  };
  using Returns = std::vector<Return>;
  struct Cell {
    Returns returns;
    bool is_plane = false;
    depth::CellPlane plane;
  };
  struct Surface {
    Returns returns;
    depth::CellPlane plane;
    float reach_px;  ///< Negative: gives no depth.
  };

  Cell& cell(int column, int row) {
    return cells_[static_cast<std::size_t>(row * columns_ + column)];
  }
  Returns around(int column, int row, int radius);
  int planes_around(int column, int row);
  float cosine(int column, int row) const;
  depth::PlaneFit fit(const Returns& returns, int column, int row) const;
  void fit_cells();
  void hide_returns();
  void drop_unsupported();
  std::vector<Surface> surfaces(int column, int row);
  void add_unexplained(Returns left, int column, int row, std::vector<Surface>& surfaces) const;
  void add_cluster(const Returns& returns,
                   int column,
                   int row,
                   std::vector<Surface>& surfaces) const;
  bool add_fit(const Returns& returns, int column, int row, std::vector<Surface>& surfaces) const;
  void fill_cell(int column, int row);
  void fill_pixel(int u, int v, int column, int row, const std::vector<Surface>& surfaces);
  float noise_sigma(float rho, float slope2, int column, int row) const;

  sensors::CameraModel camera_;
  depth::DepthProjectorConfig config_;
  depth::NoiseModel noise_;
  int columns_;
  int rows_;
  std::vector<Cell> cells_;
  float reach_px_ = 0.0F;
};

}  // namespace camvox::test
