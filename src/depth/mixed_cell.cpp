#include "mixed_cell.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "camvox/config/target_clones.hpp"

namespace camvox::depth {
namespace {

constexpr std::size_t kPixels = kCell * kCell;
constexpr float kMiddle = 0.5F * (kCell - 1);
/// With fewer in the cell and its neighbours, the ring around them is looked at, too.
constexpr std::size_t kFewReturns = 6;
/// A cell without returns of its own stays empty with fewer planes beside it: in between others of
/// its kind, as in a tree's crown, there is nothing to hold on to.
constexpr int kLeastPlanesAround = 2;
/// Returns that a neighbour's plane must explain to count as a surface here.
constexpr int kLeastInliers = 3;
/// Fewer do not get a plane of their own.
constexpr std::size_t kLeastForPlane = 5;
constexpr float kInlierSigmas = 3.5F;
/// How far a neighbour's plane may be off, as a share of depth, beside the noise.
constexpr float kPlaneTolerance = 0.004F;
/// A surface may go on this far beyond its outermost returns.
constexpr float kBeyond_px = 1.5F;
/// A return alone at its depth stands for itself this far.
constexpr float kLoneReach_px = 1.5F;
/// Slope of its surface, as that of an incidence of 63 degrees.
constexpr float kLoneSlope = 2.0F;
/// Of a surface that gives no depth.
constexpr float kNoReach_px = -1.0F;
/// Relief between a pixel and the nearest return, per pixel, as a share of inverse depth.
constexpr float kReliefPerPixel = 0.0001F;
/// Bits that one pass over the returns sets: as wide as a float, so that the two go together.
constexpr std::size_t kWord = 32;

float squared(float x) { return x * x; }

}  // namespace

/// For every pixel of the cell the nearest surface and how near the second one is.
struct MixedCellFiller::Nearest {
  Nearest() {
    best2.fill(std::numeric_limits<float>::max());
    second2.fill(std::numeric_limits<float>::max());
    rho.fill(0.0F);
    sigma_rho.fill(0.0F);
    best_rho.fill(0.0F);
    second_rho.fill(0.0F);
  }
  Distances best2;
  Distances second2;
  Distances rho;  ///< Inverse depth of the nearest surface; 0: it must not have one here.
  Distances sigma_rho;
  Distances best_rho;  ///< The same, also where it must not have one.
  Distances second_rho;
};

float MixedCellFiller::range_sigma(float rho) const {
  return static_cast<float>(noise_.range_sigma_m) * cosine_ * rho * rho;
}

float MixedCellFiller::noise_sigma(float rho, float slope2) const {
  const float range = range_sigma(rho);
  return std::sqrt(range * range + slope2 * squared(static_cast<float>(noise_.angle_sigma_px)));
}

void MixedCellFiller::gather(const CellGrid& grid, std::size_t cell) {
  returns_.count = 0;
  std::size_t count = grid.count(cell, 1);
  if (count == 0) return;
  std::size_t radius = 1;
  if (count < kFewReturns) count = grid.count(cell, ++radius);
  gather(grid, cell, radius, (count + kMostReturns - 1) / kMostReturns);
  const auto side = static_cast<float>((2 * radius + 1) * kCell);
  reach_px_ = std::min(rule_.fill_reach_px, side / std::sqrt(static_cast<float>(count)));
}

void MixedCellFiller::gather(const CellGrid& grid,
                             std::size_t cell,
                             std::size_t radius,
                             std::size_t step) {
  const ProjectedPoints& points = grid.points();
  const auto stride = static_cast<std::size_t>(grid.columns());
  std::size_t skip = 0;
  std::size_t count = 0;
  for (std::size_t c = cell - radius * stride; c <= cell + radius * stride; c += stride) {
    const std::size_t end = grid.end(c + radius);
    std::size_t i = grid.begin(c - radius) + skip;
    for (; i < end; i += step) {
      returns_.u_px[count] = points.u_px[i] - u_middle_;
      returns_.v_px[count] = points.v_px[i] - v_middle_;
      returns_.rho[count] = points.rho[i];
      ++count;
    }
    skip = i - end;
  }
  returns_.count = count;
}

void MixedCellFiller::propose(const PlaneMap& planes,
                              std::size_t cell,
                              int columns,
                              Hypotheses& hypotheses) const {
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const std::size_t other = cell + static_cast<std::size_t>(dy * columns + dx);
      if (other == cell || planes.kind(other) != CellKind::kPlane) continue;
      CellPlane plane = planes.plane(other);
      plane.rho -= static_cast<float>(kCell) * (static_cast<float>(dx) * plane.slope_u +
                                                static_cast<float>(dy) * plane.slope_v);
      const float slope2 = squared(plane.slope_u) + squared(plane.slope_v);
      const float bound =
          kInlierSigmas * noise_sigma(plane.rho, slope2) + kPlaneTolerance * plane.rho;
      hypotheses.list[hypotheses.count++] = {plane, bound, 0};
    }
  }
}

/// Which returns each neighbour's plane explains. Whole words, so that the loop vectorises: behind
/// the last return are some that no plane explains.
CAMVOX_TARGET_CLONES
void MixedCellFiller::explain(Returns& returns, Hypotheses& hypotheses) {
  const std::size_t words = (returns.count + kWord - 1) / kWord;
  for (std::size_t i = returns.count; i < words * kWord; ++i) {
    returns.u_px[i] = returns.v_px[i] = 0.0F;
    returns.rho[i] = std::numeric_limits<float>::max();
  }
  for (std::size_t h = 0; h < hypotheses.count; ++h) {
    const CellPlane plane = hypotheses.list[h].plane;
    const float bound = hypotheses.list[h].bound;
    std::uint64_t inliers = 0;
    for (std::size_t word = 0; word < words; ++word) {
      const float* u = &returns.u_px[word * kWord];
      const float* v = &returns.v_px[word * kWord];
      const float* rho = &returns.rho[word * kWord];
      std::uint32_t bits = 0;
      for (std::uint32_t i = 0; i < kWord; ++i) {
        const float error = rho[i] - plane.rho - plane.slope_u * u[i] - plane.slope_v * v[i];
        bits |= std::abs(error) < bound ? 1U << i : 0U;
      }
      inliers |= static_cast<std::uint64_t>(bits) << (word * kWord);
    }
    hypotheses.list[h].inliers = inliers;
  }
}

void MixedCellFiller::split(const PlaneMap& planes, std::size_t cell, int columns) {
  Hypotheses hypotheses;
  propose(planes, cell, columns, hypotheses);
  if (hypotheses.count > 0) explain(returns_, hypotheses);
  std::uint64_t left = ~0ULL >> (kMostReturns - returns_.count);
  sorted_.count = 0;
  surface_count_ = 0;
  gives_depth_ = false;
  while (true) {
    const Hypothesis* best = nullptr;
    int most = kLeastInliers - 1;
    for (std::size_t h = 0; h < hypotheses.count; ++h) {
      const int inliers = std::popcount(hypotheses.list[h].inliers & left);
      if (inliers <= most) continue;
      best = &hypotheses.list[h];
      most = inliers;
    }
    if (best == nullptr) break;
    const std::size_t begin = sorted_.count;
    for (std::uint64_t taken = best->inliers & left; taken != 0; taken &= taken - 1) {
      sorted_.set(sorted_.count++, returns_, static_cast<std::size_t>(std::countr_zero(taken)));
    }
    left &= ~best->inliers;
    if (!add_surface(begin, sorted_.count, &best->plane)) add_cluster(begin, sorted_.count);
  }
  split_by_gaps(left);
}

/// Index of each key when they are sorted from large to small; no two are equal. For few keys,
/// counting those before each is quicker than sorting: nothing to guess for the processor.
CAMVOX_TARGET_CLONES
void MixedCellFiller::rank(Keys& keys, std::size_t count, Keys& ranks) {
  const std::size_t words = (count + kWord / 2 - 1) / (kWord / 2);
  for (std::size_t k = count; k < words * (kWord / 2); ++k) keys[k] = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t key = keys[k];
    std::int32_t before = 0;
    for (std::size_t word = 0; word < words; ++word) {
      const std::int32_t* some = &keys[word * (kWord / 2)];
      for (std::size_t i = 0; i < kWord / 2; ++i) before += some[i] > key ? 1 : 0;
    }
    ranks[k] = before;
  }
}

/// The returns that no neighbour's plane explains, one bit each: from near to far, those without a
/// gap between them together.
void MixedCellFiller::split_by_gaps(std::uint64_t left) {
  // The bits of a positive float go up with it; the lowest give way to the index.
  constexpr std::int32_t kIndexBits = kMostReturns - 1;
  Keys keys;
  Keys ranks;
  std::size_t count = 0;
  for (; left != 0; left &= left - 1) {
    const int i = std::countr_zero(left);
    const float rho = returns_.rho[static_cast<std::size_t>(i)];
    keys[count++] = (std::bit_cast<std::int32_t>(rho) & ~kIndexBits) | i;
  }
  if (count == 0) return;
  rank(keys, count, ranks);
  std::size_t begin = sorted_.count;
  sorted_.count += count;
  for (std::size_t k = 0; k < count; ++k) {
    sorted_.set(begin + static_cast<std::size_t>(ranks[k]),
                returns_,
                static_cast<std::size_t>(keys[k] & kIndexBits));
  }
  for (std::size_t i = begin + 1; i <= sorted_.count; ++i) {
    const float before = sorted_.rho[i - 1];
    const bool gap =
        i == sorted_.count ||
        before - sorted_.rho[i] > rule_.surface_gap * before + kInlierSigmas * range_sigma(before);
    if (!gap) continue;
    add_cluster(begin, i);
    begin = i;
  }
}

/// A cluster of returns of about one depth: without a plane through it, several only compete.
void MixedCellFiller::add_cluster(std::size_t begin, std::size_t end) {
  if (end - begin >= kLeastForPlane && add_surface(begin, end, nullptr)) return;
  const float rho = sorted_.rho[begin];
  if (end - begin > 1) {
    add(begin, end, {rho, 0.0F, 0.0F, 0.0F}, kNoReach_px);
    return;
  }
  const float slope = kLoneSlope * rho / static_cast<float>(noise_.focal_px);
  const float sigma = std::hypot(noise_sigma(rho, slope * slope), slope * kLoneReach_px);
  Surface& surface = add(begin, end, {rho, 0.0F, 0.0F, sigma}, kLoneReach_px);
  gives_depth_ |= find_octagon(surface);
}

/// Returns false when the returns are too rough for a plane. One that does not touch the cell need
/// not be known well: it only competes.
bool MixedCellFiller::add_surface(std::size_t begin, std::size_t end, const CellPlane* known) {
  const CellPlane at_first{sorted_.rho[begin], 0.0F, 0.0F, 0.0F};
  Surface& surface = add(begin, end, known != nullptr ? *known : at_first, kNoReach_px);
  if (end - begin < kLeastForPlane || !find_octagon(surface)) return true;
  const CellGrid::Moments m =
      CellGrid::sum(&sorted_.u_px[begin], &sorted_.v_px[begin], &sorted_.rho[begin], end - begin);
  const PlaneFit fit = fit_plane(m.data(), 0.0, 0.0, cosine_, noise_);
  const double rough2 = std::max(0.0, fit.sum_squares / fit.count - fit.noise_variance);
  const double limit = rule_.max_roughness * fit.rho;
  if (!(rough2 <= limit * limit)) {
    --surface_count_;
    return false;
  }
  surface.plane = {static_cast<float>(fit.rho),
                   static_cast<float>(fit.slope_u),
                   static_cast<float>(fit.slope_v),
                   static_cast<float>(std::sqrt(fit.variance + rough2))};
  surface.reach_px = reach_px_;
  gives_depth_ = true;
  return true;
}

MixedCellFiller::Surface& MixedCellFiller::add(std::size_t begin,
                                               std::size_t end,
                                               const CellPlane& plane,
                                               float reach_px) {
  Surface& surface = surfaces_[surface_count_++];
  surface.begin = begin;
  surface.end = end;
  surface.plane = plane;
  surface.reach_px = reach_px;
  surface.low.fill(0.0F);
  surface.high.fill(0.0F);
  return surface;
}

/// Returns whether the octagon touches the cell.
bool MixedCellFiller::find_octagon(Surface& surface) const {
  std::array<float, 4> low;
  std::array<float, 4> high;
  low.fill(std::numeric_limits<float>::max());
  high.fill(std::numeric_limits<float>::lowest());
  for (std::size_t i = surface.begin; i < surface.end; ++i) {
    const float u = sorted_.u_px[i];
    const float v = sorted_.v_px[i];
    const std::array<float, 4> along = {u, v, u + v, u - v};
    for (std::size_t k = 0; k < 4; ++k) {
      low[k] = along[k] < low[k] ? along[k] : low[k];
      high[k] = along[k] > high[k] ? along[k] : high[k];
    }
  }
  bool touches = true;
  for (std::size_t k = 0; k < 4; ++k) {
    const float corner = k < 2 ? kMiddle : 2.0F * kMiddle;
    surface.low[k] = low[k] - kBeyond_px;
    surface.high[k] = high[k] + kBeyond_px;
    touches &= surface.low[k] <= corner && surface.high[k] >= -corner;
  }
  return touches;
}

CAMVOX_TARGET_CLONES
void MixedCellFiller::measure(const Returns& returns,
                              const Surface& surface,
                              Distances& distances) {
  float* const d = distances.data();
  for (std::size_t px = 0; px < kPixels; ++px) d[px] = std::numeric_limits<float>::max();
  for (std::size_t i = surface.begin; i < surface.end; ++i) {
    const float u_px = returns.u_px[i];
    const float v_px = returns.v_px[i];
    float du2[kCell];
    float dv2[kCell];
    for (int k = 0; k < kCell; ++k) {
      const float du = static_cast<float>(k) - kMiddle - u_px;
      const float dv = static_cast<float>(k) - kMiddle - v_px;
      du2[k] = du * du;
      dv2[k] = dv * dv;
    }
#pragma GCC unroll 8  // A row is one instruction or two: a loop would double them.
    for (int v = 0; v < kCell; ++v) {
      for (int u = 0; u < kCell; ++u) {
        const float d2 = du2[u] + dv2[v];
        float& least = d[v * kCell + u];
        least = d2 < least ? d2 : least;
      }
    }
  }
}

/// Gives the pixels to `surface` that it is nearest to so far, its depth included if it may have
/// one.
CAMVOX_TARGET_CLONES
void MixedCellFiller::merge(const Surface& surface,
                            float least_rho,
                            const Distances& distances,
                            Nearest& nearest) {
  const CellPlane plane = surface.plane;
  const float reach2 = surface.reach_px * std::abs(surface.reach_px);
  least_rho = std::max(0.5F * plane.rho, least_rho);
  const std::array<float, 4> low = surface.low;
  const std::array<float, 4> high = surface.high;
  for (int v = 0; v < kCell; ++v) {
    const float dv = static_cast<float>(v) - kMiddle;
    const float rho_row = plane.rho + plane.slope_v * dv;
    for (int u = 0; u < kCell; ++u) {
      const auto px = static_cast<std::size_t>(v * kCell + u);
      const float du = static_cast<float>(u) - kMiddle;
      const float rho = rho_row + plane.slope_u * du;
      const float d2 = distances[px];
      const int valid = static_cast<int>(d2 <= reach2) & static_cast<int>(du >= low[0]) &
                        static_cast<int>(du <= high[0]) & static_cast<int>(dv >= low[1]) &
                        static_cast<int>(dv <= high[1]) & static_cast<int>(du + dv >= low[2]) &
                        static_cast<int>(du + dv <= high[2]) & static_cast<int>(du - dv >= low[3]) &
                        static_cast<int>(du - dv <= high[3]) & static_cast<int>(rho > least_rho);
      const float best2 = nearest.best2[px];
      const float second2 = nearest.second2[px];
      const bool nearer = d2 < best2;
      const float loser = nearer ? best2 : d2;
      nearest.best2[px] = nearer ? d2 : best2;
      nearest.second2[px] = loser < second2 ? loser : second2;
      const float best_rho = nearest.best_rho[px];
      const float loser_rho = nearer ? best_rho : rho;
      nearest.best_rho[px] = nearer ? rho : best_rho;
      nearest.second_rho[px] = loser < second2 ? loser_rho : nearest.second_rho[px];
      const float offered = valid != 0 ? rho : 0.0F;
      nearest.rho[px] = nearer ? offered : nearest.rho[px];
      nearest.sigma_rho[px] = nearer ? plane.sigma_rho : nearest.sigma_rho[px];
    }
  }
}

/// Pixels about as near to a second surface stay empty. Returns whether any has depth.
CAMVOX_TARGET_CLONES
bool MixedCellFiller::decide(const Nearest& nearest, CellPixels& pixels) const {
  const float near_band = 2.0F * rule_.near_margin_px;
  const float far_band = 2.0F * rule_.far_margin_px;
  int any = 0;
  for (std::size_t px = 0; px < kPixels; ++px) {
    const float rho = nearest.rho[px];
    const float band = nearest.second_rho[px] > nearest.best_rho[px] ? far_band : near_band;
    const float least = std::sqrt(nearest.best2[px]) + band;
    const int filled =
        static_cast<int>(nearest.second2[px] >= least * least) & static_cast<int>(rho > 0.0F);
    const float z = 1.0F / (rho > 0.0F ? rho : 1.0F);
    const float variance =
        squared(nearest.sigma_rho[px]) + squared(kReliefPerPixel * rho) * nearest.best2[px];
    pixels.depth_m[px] = filled != 0 ? z : 0.0F;
    pixels.sigma_m[px] = filled != 0 ? std::sqrt(variance) * z * z : 0.0F;
    any |= filled;
  }
  return any != 0;
}

bool MixedCellFiller::fill(
    const CellGrid& grid, const PlaneMap& planes, int column, int row, CellPixels& pixels) {
  const std::size_t cell = grid.cell(column, row);
  u_middle_ = PlaneMap::middle_px(column);
  v_middle_ = PlaneMap::middle_px(row);
  cosine_ = planes.cosine(cell);
  if (grid.count(cell, 0) == 0 && planes.count_around(cell) < kLeastPlanesAround) return false;
  gather(grid, cell);
  if (returns_.count == 0) return false;
  split(planes, cell, grid.columns());
  if (!gives_depth_) return false;
  Nearest nearest;
  Distances distances;
  for (std::size_t s = 0; s < surface_count_; ++s) {
    measure(sorted_, surfaces_[s], distances);
    merge(surfaces_[s], rule_.least_rho, distances, nearest);
  }
  return decide(nearest, pixels);
}

}  // namespace camvox::depth
