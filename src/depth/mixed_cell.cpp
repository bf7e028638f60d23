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
/// Returns that are looked at for one cell; of more, every second, third...
constexpr std::size_t kMostReturns = 64;
/// With fewer in the cell and its neighbours, the ring around them is looked at, too.
constexpr std::size_t kFewReturns = 6;
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

float squared(float x) { return x * x; }

}  // namespace

/// For every pixel of the cell the nearest surface and how near the second one is.
struct MixedCellFiller::Nearest {
  Distances best2;
  Distances second2;
  Distances rho;  ///< Inverse depth of the nearest surface; 0: it must not have one here.
  Distances sigma_rho;
  Distances best_rho;  ///< The same, also where it must not have one.
  Distances second_rho;
};

float MixedCellFiller::noise_sigma(float rho, float slope2) const {
  const float range = static_cast<float>(noise_.range_sigma_m) * cosine_ * rho * rho;
  return std::sqrt(range * range + slope2 * squared(static_cast<float>(noise_.angle_sigma_px)));
}

void MixedCellFiller::gather(const CellGrid& grid, std::size_t cell) {
  const ProjectedPoints& points = grid.points();
  const auto stride = static_cast<std::size_t>(grid.columns());
  for (std::size_t radius = 1; radius <= 2; ++radius) {
    sorted_.clear();
    for (std::size_t c = cell - radius * stride; c <= cell + radius * stride; c += stride) {
      for (std::size_t i = grid.begin(c - radius); i < grid.end(c + radius); ++i) {
        if (grid.is_hidden(i)) continue;
        sorted_.push_back({points.u_px[i] - u_middle_, points.v_px[i] - v_middle_, points.rho[i]});
      }
    }
    const auto side = static_cast<float>((2 * radius + 1) * kCell);
    reach_px_ =
        std::min(rule_.fill_reach_px,
                 side / std::sqrt(static_cast<float>(std::max<std::size_t>(1, sorted_.size()))));
    if (sorted_.size() >= kFewReturns) break;
  }
  const std::size_t step = (sorted_.size() + kMostReturns - 1) / kMostReturns;
  if (step > 1) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < sorted_.size(); i += step) sorted_[kept++] = sorted_[i];
    sorted_.resize(kept);
  }
}

void MixedCellFiller::split(const PlaneMap& planes, std::size_t cell, int columns) {
  // Which returns each neighbour's plane explains, one bit a return.
  struct Hypothesis {
    CellPlane plane;  ///< At the middle of this cell.
    std::uint64_t inliers;
  };
  std::array<Hypothesis, 8> hypotheses;
  std::size_t count = 0;
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
      std::uint64_t inliers = 0;
      for (std::size_t i = 0; i < sorted_.size(); ++i) {
        const Return& p = sorted_[i];
        const float error = p.rho - plane.rho - plane.slope_u * p.u_px - plane.slope_v * p.v_px;
        inliers |= static_cast<std::uint64_t>(std::abs(error) < bound) << i;
      }
      hypotheses[count++] = {plane, inliers};
    }
  }
  std::uint64_t left = sorted_.size() == 64 ? ~0ULL : (1ULL << sorted_.size()) - 1;
  rest_ = sorted_;
  sorted_.clear();
  surfaces_.clear();
  while (true) {
    int best = -1;
    int most = kLeastInliers - 1;
    for (std::size_t h = 0; h < count; ++h) {
      const int inliers = std::popcount(hypotheses[h].inliers & left);
      if (inliers > most) {
        best = static_cast<int>(h);
        most = inliers;
      }
    }
    if (best < 0) break;
    const Hypothesis& hypothesis = hypotheses[static_cast<std::size_t>(best)];
    const std::uint64_t taken = hypothesis.inliers & left;
    const std::size_t begin = sorted_.size();
    for (std::size_t i = 0; i < rest_.size(); ++i) {
      if ((taken >> i & 1U) != 0) sorted_.push_back(rest_[i]);
    }
    left &= ~taken;
    add_surface(begin, sorted_.size(), &hypothesis.plane);
  }
  const std::size_t begin = sorted_.size();
  for (std::size_t i = 0; i < rest_.size(); ++i) {
    if ((left >> i & 1U) != 0) sorted_.push_back(rest_[i]);
  }
  split_by_gaps(begin);
}

void MixedCellFiller::split_by_gaps(std::size_t begin) {
  const auto from = sorted_.begin() + static_cast<std::ptrdiff_t>(begin);
  std::sort(from, sorted_.end(), [](const Return& a, const Return& b) { return a.rho > b.rho; });
  for (std::size_t i = begin + 1; i <= sorted_.size(); ++i) {
    const bool gap =
        i == sorted_.size() || sorted_[i - 1].rho - sorted_[i].rho >
                                   rule_.surface_gap * sorted_[i - 1].rho +
                                       kInlierSigmas * noise_sigma(sorted_[i - 1].rho, 0.0F);
    if (!gap) continue;
    add_cluster(begin, i);
    begin = i;
  }
}

/// A cluster of returns of about one depth: without a plane through it, several only compete.
void MixedCellFiller::add_cluster(std::size_t begin, std::size_t end) {
  if (end - begin >= kLeastForPlane) {
    const std::size_t before = surfaces_.size();
    add_surface(begin, end, nullptr);
    if (surfaces_.size() > before) return;
  }
  const float rho = sorted_[begin].rho;
  const float slope = kLoneSlope * rho / static_cast<float>(noise_.focal_px);
  const float sigma = std::hypot(noise_sigma(rho, slope * slope), slope * kLoneReach_px);
  const float reach_px = end - begin == 1 ? kLoneReach_px : kNoReach_px;
  add_octagon({begin, end, {rho, 0.0F, 0.0F, sigma}, reach_px, {}, {}});
}

void MixedCellFiller::add_surface(std::size_t begin, std::size_t end, const CellPlane* known) {
  if (known != nullptr && end - begin < kLeastForPlane) {
    add_octagon({begin, end, *known, kNoReach_px, {}, {}});
    return;
  }
  CellGrid::Moments m{};
  for (std::size_t i = begin; i < end; ++i) {
    const double u = sorted_[i].u_px;
    const double v = sorted_[i].v_px;
    const double r = sorted_[i].rho;
    const double values[] = {1.0, u, v, r, u * u, u * v, v * v, u * r, v * r, r * r};
    for (std::size_t k = 0; k < m.size(); ++k) m[k] += values[k];
  }
  const PlaneFit fit = fit_plane(m.data(), 0.0, 0.0, cosine_, noise_);
  const double rough2 = std::max(0.0, fit.sum_squares / fit.count - fit.noise_variance);
  const double limit = rule_.max_roughness * fit.rho;
  if (!(rough2 <= limit * limit)) {
    if (known != nullptr) add_cluster(begin, end);
    return;
  }
  const CellPlane plane{static_cast<float>(fit.rho),
                        static_cast<float>(fit.slope_u),
                        static_cast<float>(fit.slope_v),
                        static_cast<float>(std::sqrt(fit.variance + rough2))};
  add_octagon({begin, end, plane, reach_px_, {}, {}});
}

void MixedCellFiller::add_octagon(Surface surface) {
  surface.low.fill(std::numeric_limits<float>::max());
  surface.high.fill(std::numeric_limits<float>::lowest());
  for (std::size_t i = surface.begin; i < surface.end; ++i) {
    const float u = sorted_[i].u_px;
    const float v = sorted_[i].v_px;
    const std::array<float, 4> along = {u, v, u + v, u - v};
    for (std::size_t k = 0; k < 4; ++k) {
      surface.low[k] = std::min(surface.low[k], along[k] - kBeyond_px);
      surface.high[k] = std::max(surface.high[k], along[k] + kBeyond_px);
    }
  }
  surfaces_.push_back(surface);
}

CAMVOX_TARGET_CLONES
void MixedCellFiller::measure(const Surface& surface, Distances& distances) const {
  float* const d = distances.data();
  for (std::size_t px = 0; px < kPixels; ++px) d[px] = std::numeric_limits<float>::max();
  for (std::size_t i = surface.begin; i < surface.end; ++i) {
    const Return p = sorted_[i];
    float du2[kCell];
    for (int u = 0; u < kCell; ++u) {
      const float du = static_cast<float>(u) - kMiddle - p.u_px;
      du2[u] = du * du;
    }
    for (int v = 0; v < kCell; ++v) {
      const float dv = static_cast<float>(v) - kMiddle - p.v_px;
      const float dv2 = dv * dv;
      for (int u = 0; u < kCell; ++u) {
        const float d2 = du2[u] + dv2;
        float& least = d[v * kCell + u];
        least = d2 < least ? d2 : least;
      }
    }
  }
}

/// Gives the pixels to `surface` that it is nearest to so far, its depth included if it may have
/// one.
CAMVOX_TARGET_CLONES
void MixedCellFiller::merge(const Surface& surface, const Distances& distances, Nearest& nearest) {
  const CellPlane plane = surface.plane;
  const float reach2 = surface.reach_px * std::abs(surface.reach_px);
  const std::array<float, 4> low = surface.low;
  const std::array<float, 4> high = surface.high;
  for (int v = 0; v < kCell; ++v) {
    const float dv = static_cast<float>(v) - kMiddle;
    const float rho_row = plane.rho + plane.slope_v * dv;
    for (int u = 0; u < kCell; ++u) {
      const int px = v * kCell + u;
      const float du = static_cast<float>(u) - kMiddle;
      const float rho = rho_row + plane.slope_u * du;
      const float d2 = distances[static_cast<std::size_t>(px)];
      const int valid = static_cast<int>(d2 <= reach2) & static_cast<int>(du >= low[0]) &
                        static_cast<int>(du <= high[0]) & static_cast<int>(dv >= low[1]) &
                        static_cast<int>(dv <= high[1]) & static_cast<int>(du + dv >= low[2]) &
                        static_cast<int>(du + dv <= high[2]) & static_cast<int>(du - dv >= low[3]) &
                        static_cast<int>(du - dv <= high[3]) &
                        static_cast<int>(rho > 0.5F * plane.rho);
      const float best2 = nearest.best2[static_cast<std::size_t>(px)];
      const float second2 = nearest.second2[static_cast<std::size_t>(px)];
      const bool nearer = d2 < best2;
      const float loser = nearer ? best2 : d2;
      nearest.best2[static_cast<std::size_t>(px)] = nearer ? d2 : best2;
      nearest.second2[static_cast<std::size_t>(px)] = loser < second2 ? loser : second2;
      float& best_rho = nearest.best_rho[static_cast<std::size_t>(px)];
      const float loser_rho = nearer ? best_rho : rho;
      best_rho = nearer ? rho : best_rho;
      float& second_rho = nearest.second_rho[static_cast<std::size_t>(px)];
      second_rho = loser < second2 ? loser_rho : second_rho;
      const float offered = valid != 0 ? rho : 0.0F;
      float& kept = nearest.rho[static_cast<std::size_t>(px)];
      kept = nearer ? offered : kept;
      float& sigma = nearest.sigma_rho[static_cast<std::size_t>(px)];
      sigma = nearer ? plane.sigma_rho : sigma;
    }
  }
}

/// Pixels about as near to a second surface stay empty.
CAMVOX_TARGET_CLONES
void MixedCellFiller::decide(const Nearest& nearest, CellPixels& pixels) const {
  const float near_band = 2.0F * rule_.near_margin_px;
  const float far_band = 2.0F * rule_.far_margin_px;
  for (std::size_t px = 0; px < kPixels; ++px) {
    const float rho = nearest.rho[px];
    const float band = nearest.second_rho[px] > nearest.best_rho[px] ? far_band : near_band;
    const bool clear = std::sqrt(nearest.second2[px]) - std::sqrt(nearest.best2[px]) >= band;
    const bool filled = clear & (rho > 0.0F);
    const float z = 1.0F / (rho > 0.0F ? rho : 1.0F);
    const float variance =
        squared(nearest.sigma_rho[px]) + squared(kReliefPerPixel * rho) * nearest.best2[px];
    pixels.depth_m[px] = filled ? z : 0.0F;
    pixels.sigma_m[px] = filled ? std::sqrt(variance) * z * z : 0.0F;
  }
}

void MixedCellFiller::fill(
    const CellGrid& grid, const PlaneMap& planes, int column, int row, CellPixels& pixels) {
  const std::size_t cell = grid.cell(column, row);
  u_middle_ = PlaneMap::middle_px(column);
  v_middle_ = PlaneMap::middle_px(row);
  cosine_ = planes.cosine(cell);
  gather(grid, cell);
  if (sorted_.empty()) {
    pixels = {};
    return;
  }
  split(planes, cell, grid.columns());
  Nearest nearest;
  nearest.best2.fill(std::numeric_limits<float>::max());
  nearest.second2.fill(std::numeric_limits<float>::max());
  nearest.rho.fill(0.0F);
  nearest.sigma_rho.fill(0.0F);
  nearest.best_rho.fill(0.0F);
  nearest.second_rho.fill(0.0F);
  Distances distances;
  for (const Surface& surface : surfaces_) {
    measure(surface, distances);
    merge(surface, distances, nearest);
  }
  decide(nearest, pixels);
}

}  // namespace camvox::depth
