#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_grid.hpp"
#include "plane_map.hpp"

namespace camvox::depth {

/// When one return hides another.
struct OcclusionRule {
  float surface_gap = 0.03F;     ///< Nearer by this share of depth at least.
  float least_footprint_px = 2;  ///< A return stands for the surface this far around it at least,
  float most_footprint_px = 12;  ///< at most, and in between for one mean distance of the returns.
};

/// Marks the returns that the lidar saw past the edge of a nearer surface while the camera cannot:
/// on the way from the lidar's view to the camera's, they change sides with a return of that
/// surface, along the direction of parallax, and end up within its footprint. Only cells that are
/// not a plane are looked at. Writes one entry a return (1: hidden), returns how many are hidden.
std::size_t find_hidden(const PlaneMap& planes,
                        const OcclusionRule& rule,
                        const CellGrid& grid,
                        std::vector<std::uint8_t>& hidden);

}  // namespace camvox::depth
