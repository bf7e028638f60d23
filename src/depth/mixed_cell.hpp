#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

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
  float least_rho = 0.0F;  ///< Inverse of the largest depth: a surface that goes on stops there.
};

/// Depth and sigma of a cell's pixels, row by row; 0: none.
struct CellPixels {
  std::array<float, kCell * kCell> depth_m;
  std::array<float, kCell * kCell> sigma_m;
};

/// Fills cells return by return: sorts the returns around a cell into surfaces, then lets every
/// pixel decide for the surface of its nearest return. Keeps its working memory, which has a fixed
/// size: thousands of cells an image leave no time for more.
class MixedCellFiller {
 public:
  MixedCellFiller(const MixedCellRule& rule, const NoiseModel& noise)
      : rule_(rule), noise_(noise) {}

  /// Returns whether any pixel has depth; else `pixels` is not written. No return in the cell and
  /// beside it: no depth.
  [[nodiscard]] bool fill(
      const CellGrid& grid, const PlaneMap& planes, int column, int row, CellPixels& pixels);

 private:
  /// Returns that are looked at for one cell; of more, every second, third...
  static constexpr std::size_t kMostReturns = 64;
  /// Offsets from the cell's middle and inverse depth, a list for each.
  struct Returns {
    alignas(64) std::array<float, kMostReturns> u_px;
    alignas(64) std::array<float, kMostReturns> v_px;
    alignas(64) std::array<float, kMostReturns> rho;
    std::size_t count = 0;

    void set(std::size_t at, const Returns& from, std::size_t i) {
      u_px[at] = from.u_px[i];
      v_px[at] = from.v_px[i];
      rho[at] = from.rho[i];
    }
  };
  /// A neighbour's plane, at the middle of this cell, and which returns it explains, one bit each.
  struct Hypothesis {
    CellPlane plane;
    float bound;
    std::uint64_t inliers;
  };
  struct Hypotheses {
    std::array<Hypothesis, 8> list;
    std::size_t count = 0;
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
  void gather(const CellGrid& grid, std::size_t cell, std::size_t radius, std::size_t step);
  void split(const PlaneMap& planes, std::size_t cell, int columns);
  void propose(const PlaneMap& planes, std::size_t cell, int columns, Hypotheses& hypotheses) const;
  static void explain(Returns& returns, Hypotheses& hypotheses);
  using Keys = std::array<std::int32_t, kMostReturns>;
  static void rank(Keys& keys, std::size_t count, Keys& ranks);
  void split_by_gaps(std::uint64_t left);
  void add_cluster(std::size_t begin, std::size_t end);
  bool add_surface(std::size_t begin, std::size_t end, const CellPlane* known);
  Surface& add(std::size_t begin, std::size_t end, const CellPlane& plane, float reach_px);
  [[nodiscard]] bool find_octagon(Surface& surface) const;
  static void measure(const Returns& returns, const Surface& surface, Distances& distances);
  static void merge(const Surface& surface,
                    float least_rho,
                    const Distances& distances,
                    Nearest& nearest);
  [[nodiscard]] bool decide(const Nearest& nearest, CellPixels& pixels) const;
  /// Of inverse depth: from the range, and from the direction, too.
  [[nodiscard]] float range_sigma(float rho) const;
  [[nodiscard]] float noise_sigma(float rho, float slope2) const;

  MixedCellRule rule_;
  NoiseModel noise_;
  float u_middle_ = 0.0F;
  float v_middle_ = 0.0F;
  float cosine_ = 1.0F;
  float reach_px_ = 0.0F;
  Returns returns_;  ///< As gathered.
  Returns sorted_;   ///< By surface.
  std::array<Surface, kMostReturns> surfaces_;
  std::size_t surface_count_ = 0;
  bool gives_depth_ = false;  ///< One of the surfaces might, in this cell.
};

}  // namespace camvox::depth
