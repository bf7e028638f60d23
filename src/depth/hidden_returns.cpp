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
  const float shift_u = points.shift_u_px[far] - points.shift_u_px[near];
  const float shift_v = points.shift_v_px[far] - points.shift_v_px[near];
  const float shift2 = shift_u * shift_u + shift_v * shift_v;
  if (shift2 < kLeastShift_px * kLeastShift_px) return false;
  const float du = points.u_px[far] - points.u_px[near];
  const float dv = points.v_px[far] - points.v_px[near];
  const float along_times_shift = du * shift_u + dv * shift_v;
  // Before the change of view it was at along - shift: on the other side if that is negative.
  if (along_times_shift <= 0.0F || along_times_shift >= shift2) return false;
  const float across_times_shift = du * shift_v - dv * shift_u;
  const float limit2 = footprint_px * footprint_px * shift2;
  return along_times_shift * along_times_shift <= limit2 &&
         across_times_shift * across_times_shift <= limit2;
}

}  // namespace

std::size_t hide_returns(const PlaneMap& planes, const OcclusionRule& rule, CellGrid& grid) {
  const ProjectedPoints& points = grid.points();
  const auto stride = static_cast<std::size_t>(grid.columns());
  std::vector<std::size_t> hidden;
  for (int row = kMargin; row < grid.rows() - kMargin; ++row) {
    for (int column = kMargin; column < grid.columns() - kMargin; ++column) {
      const std::size_t cell = grid.cell(column, row);
      if (planes.kind(cell) == CellKind::kPlane || grid.begin(cell) == grid.end(cell)) continue;
      const auto window = static_cast<float>(grid.window(cell, 1)[CellGrid::kN]);
      const float footprint = std::clamp(
          3.0F * kCell / std::sqrt(window), rule.least_footprint_px, rule.most_footprint_px);
      for (std::size_t far = grid.begin(cell); far < grid.end(cell); ++far) {
        bool found = false;
        for (std::size_t c = cell - stride; c <= cell + stride && !found; c += stride) {
          for (std::size_t near = grid.begin(c - 1); near < grid.end(c + 1) && !found; ++near) {
            found = hides(points, near, far, footprint, rule.surface_gap);
          }
        }
        if (found) hidden.push_back(far);
      }
    }
  }
  for (const std::size_t point : hidden) grid.hide(point);  // At once: order must not matter.
  return hidden.size();
}

}  // namespace camvox::depth
