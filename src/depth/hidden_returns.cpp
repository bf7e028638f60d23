#include "hidden_returns.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace camvox::depth {
namespace {

/// Less parallax than this hides nothing that the beam's width would not blur anyway.
constexpr float kLeastShift_px = 1.0F;

/// Whether return `near` hides return `far`.
bool hides(const ProjectedPoints& points,
           std::size_t near,
           std::size_t far,
           float footprint_px,
           float surface_gap) {
  if (points.rho[near] * (1.0F - surface_gap) <= points.rho[far]) return false;
  const float du = points.u_px[far] - points.u_px[near];
  const float dv = points.v_px[far] - points.v_px[near];
  if (du * du + dv * dv > 2.0F * footprint_px * footprint_px) return false;
  const float shift_u = points.shift_u_px[far] - points.shift_u_px[near];
  const float shift_v = points.shift_v_px[far] - points.shift_v_px[near];
  const float shift2 = shift_u * shift_u + shift_v * shift_v;
  if (shift2 < kLeastShift_px * kLeastShift_px) return false;
  const float along_times_shift = du * shift_u + dv * shift_v;
  // Before the change of view it was at along - shift: on the other side if that is negative.
  if (along_times_shift <= 0.0F || along_times_shift >= shift2) return false;
  const float across_times_shift = du * shift_v - dv * shift_u;
  const float limit2 = footprint_px * footprint_px * shift2;
  return along_times_shift * along_times_shift <= limit2 &&
         across_times_shift * across_times_shift <= limit2;
}

/// Returns in the cells around that are nearer than the farthest of the cell's own, by the gap.
void find_nearer(const CellGrid& grid,
                 std::size_t cell,
                 float ratio,
                 std::vector<std::size_t>& near) {
  const std::vector<float>& rho = grid.points().rho;
  near.clear();
  float least = rho[grid.begin(cell)];
  for (std::size_t i = grid.begin(cell); i < grid.end(cell); ++i) least = std::min(least, rho[i]);
  const auto stride = static_cast<std::size_t>(grid.columns());
  for (std::size_t row = cell - stride; row <= cell + stride; row += stride) {
    for (std::size_t c = row - 1; c <= row + 1; ++c) {
      if (grid.nearest(c) * ratio <= least) continue;
      for (std::size_t i = grid.begin(c); i < grid.end(c); ++i) {
        if (rho[i] * ratio > least) near.push_back(i);
      }
    }
  }
}

}  // namespace

std::size_t find_hidden(const PlaneMap& planes,
                        const OcclusionRule& rule,
                        const CellGrid& grid,
                        std::vector<std::uint8_t>& hidden) {
  const ProjectedPoints& points = grid.points();
  hidden.assign(points.size(), 0);
  std::vector<std::size_t> near;
  std::size_t count = 0;
  for (int row = kMargin; row < grid.rows() - kMargin; ++row) {
    for (int column = kMargin; column < grid.columns() - kMargin; ++column) {
      const std::size_t cell = grid.cell(column, row);
      if (planes.kind(cell) == CellKind::kPlane || grid.begin(cell) == grid.end(cell)) continue;
      find_nearer(grid, cell, 1.0F - rule.surface_gap, near);
      if (near.empty()) continue;
      const auto window = static_cast<float>(grid.count(cell, 1));
      const float footprint = std::clamp(
          3.0F * kCell / std::sqrt(window), rule.least_footprint_px, rule.most_footprint_px);
      for (std::size_t far = grid.begin(cell); far < grid.end(cell); ++far) {
        const bool found = std::any_of(near.begin(), near.end(), [&](std::size_t i) {
          return hides(points, i, far, footprint, rule.surface_gap);
        });
        hidden[far] = static_cast<std::uint8_t>(found);
        count += static_cast<std::size_t>(found);
      }
    }
  }
  return count;
}

}  // namespace camvox::depth
