#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "cell_grid.hpp"
#include "plane_map.hpp"

namespace camvox::depth {

/// How the pixels of a cell with several surfaces, or few returns, are filled.
struct MixedCellRule {
  float fill_reach_px = 10.0F;
  float near_margin_px = 1.0F;
  float far_margin_px = 4.0F;
  float surface_gap = 0.03F;
  float max_roughness = 0.02F;
};

/// Depth and sigma of a cell's pixels, row by row; 0: none.
struct CellPixels {
  std::array<float, kCell * kCell> depth_m;
  std::array<float, kCell * kCell> sigma_m;
};

/// Fills cells return by return: sorts the returns around a cell into surfaces, then lets every
/// pixel decide for the surface of its nearest return. Keeps its working memory.
class MixedCellFiller {
 public:
  MixedCellFiller(const MixedCellRule& rule, const NoiseModel& noise)
      : rule_(rule), noise_(noise) {}

  void fill(const CellGrid& grid, const PlaneMap& planes, int column, int row, CellPixels& pixels);

 private:
  struct Return {
    float u_px;
    float v_px;
    float rho;
  };
  /// A surface: the returns begin to end of `sorted_`, and the plane through them. Without a plane
  /// it gives no depth, but keeps others away.
  struct Surface {
    std::size_t begin;
    std::size_t end;
    CellPlane plane;
    float reach_px;            ///< Negative: gives no depth.
    std::array<float, 4> low;  ///< The octagon around the returns: u, v, u + v, u - v.
    std::array<float, 4> high;
  };
  using Distances = std::array<float, kCell * kCell>;
  struct Nearest;

  void gather(const CellGrid& grid, std::size_t cell);
  void split(const PlaneMap& planes, std::size_t cell, int columns);
  [[nodiscard]] std::size_t take_best_plane(const PlaneMap& planes, std::size_t cell, int columns);
  void split_by_gaps(std::size_t begin);
  void add_cluster(std::size_t begin, std::size_t end);
  void add_surface(std::size_t begin, std::size_t end, const CellPlane* known);
  void measure(const Surface& surface, Distances& distances) const;
  static void merge(const Surface& surface, const Distances& distances, Nearest& nearest);
  void decide(const Nearest& nearest, CellPixels& pixels) const;
  void add_octagon(Surface surface);
  [[nodiscard]] float noise_sigma(float rho, float slope2) const;

  MixedCellRule rule_;
  NoiseModel noise_;
  float u_middle_ = 0.0F;
  float v_middle_ = 0.0F;
  float cosine_ = 1.0F;
  float reach_px_ = 0.0F;
  std::vector<Return> sorted_;
  std::vector<Return> rest_;
  std::vector<Surface> surfaces_;
};

}  // namespace camvox::depth
