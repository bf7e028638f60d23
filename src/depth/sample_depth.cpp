#include "camvox/depth/sample_depth.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace camvox::depth {
namespace {

constexpr int kMaxRadius = 8;
/// Two surfaces are told apart by a gap in inverse depth beyond this share and these sigmas...
constexpr float kGapShare = 0.01F;
constexpr float kGapSigmas = 3.0F;
/// ...that is also this share of the whole spread: a slope has many small gaps, no large one.
constexpr float kGapOfSpread = 0.4F;
/// Spread about the plane that one surface may have, beside three sigmas.
constexpr float kRoughness = 0.02F;
/// Slope of a surface that the pixels do not tell, per pixel, as a share of inverse depth.
constexpr float kUnknownSlope = 0.005F;
/// A nearer surface needs this many pixels.
constexpr int kLeastPixels = 2;

/// A pixel with depth: offset from the location asked for, inverse depth and its sigma.
struct Pixel {
  float x;
  float y;
  float rho;
  float sigma;
};

struct Window {
  std::array<Pixel, (2 * kMaxRadius + 1) * (2 * kMaxRadius + 1)> pixels;
  int count = 0;
};

void gather(const DepthView& view, float u_px, float v_px, int radius, Window& window) {
  const int u = static_cast<int>(std::lround(u_px));
  const int v = static_cast<int>(std::lround(v_px));
  for (int row = std::max(0, v - radius); row <= std::min(view.height_px - 1, v + radius); ++row) {
    const auto offset = static_cast<std::ptrdiff_t>(row) * view.width_px;
    for (int column = std::max(0, u - radius); column <= std::min(view.width_px - 1, u + radius);
         ++column) {
      const float z = view.depth_m[offset + column];
      if (!(z > 0.0F)) continue;
      const float rho = 1.0F / z;
      window.pixels[static_cast<std::size_t>(window.count++)] = {
          static_cast<float>(column) - u_px,
          static_cast<float>(row) - v_px,
          rho,
          view.sigma_m[offset + column] * rho * rho};
    }
  }
}

/// Drops all but the pixels of the nearest surface.
void keep_nearest_surface(Window& window) {
  const auto begin = window.pixels.begin();
  const auto nearer = [](const Pixel& a, const Pixel& b) { return a.rho > b.rho; };
  const auto [far, near] = std::minmax_element(
      begin, begin + window.count, [](const Pixel& a, const Pixel& b) { return a.rho < b.rho; });
  const auto gap_bound = [](const Pixel& a, const Pixel& b) {
    return kGapShare * a.rho + kGapSigmas * std::max(a.sigma, b.sigma);
  };
  if (near->rho - far->rho <= gap_bound(*near, *far)) return;
  std::sort(begin, begin + window.count, nearer);
  for (bool found = true; found;) {
    found = false;
    const float spread = begin->rho - begin[window.count - 1].rho;
    for (int i = kLeastPixels; i < window.count && !found; ++i) {
      const float gap = begin[i - 1].rho - begin[i].rho;
      found = gap > gap_bound(begin[i - 1], begin[i]) && gap > kGapOfSpread * spread;
      if (found) window.count = i;
    }
  }
}

/// The plane rho = mean + gx (x - x_mean) + gy (y - y_mean) and how well it fits.
struct Plane {
  float at_origin = 0.0F;
  float slope = 0.0F;
  float residual_rms = 0.0F;
};

Plane fit_plane(const Window& window) {
  const auto n = static_cast<float>(window.count);
  float x = 0.0F, y = 0.0F, rho = 0.0F;
  for (int i = 0; i < window.count; ++i) {
    const Pixel& p = window.pixels[static_cast<std::size_t>(i)];
    x += p.x / n;
    y += p.y / n;
    rho += p.rho / n;
  }
  float xx = 0.0F, xy = 0.0F, yy = 0.0F, xr = 0.0F, yr = 0.0F, rr = 0.0F;
  for (int i = 0; i < window.count; ++i) {
    const Pixel& p = window.pixels[static_cast<std::size_t>(i)];
    const float dx = p.x - x, dy = p.y - y, dr = p.rho - rho;
    xx += dx * dx;
    xy += dx * dy;
    yy += dy * dy;
    xr += dx * dr;
    yr += dy * dr;
    rr += dr * dr;
  }
  // A little stiffness: pixels in a line say nothing of the slope across it, which is then 0.
  xx += 0.01F;
  yy += 0.01F;
  const float determinant = xx * yy - xy * xy;
  const float gx = (yy * xr - xy * yr) / determinant;
  const float gy = (xx * yr - xy * xr) / determinant;
  return {rho - gx * x - gy * y,
          std::hypot(gx, gy),
          std::sqrt(std::max(0.0F, rr - gx * xr - gy * yr) / n)};
}

}  // namespace

DepthSample sample_depth(const DepthView& view, float u_px, float v_px, int radius_px) {
  const bool inside = u_px > -0.5F && u_px < static_cast<float>(view.width_px) - 0.5F &&
                      v_px > -0.5F && v_px < static_cast<float>(view.height_px) - 0.5F;
  if (!inside) return {};
  Window window;
  gather(view, u_px, v_px, std::clamp(radius_px, 0, kMaxRadius), window);
  if (window.count == 0) return {};
  keep_nearest_surface(window);
  float variance = 0.0F;
  float distance2 = 1e9F;
  for (int i = 0; i < window.count; ++i) {
    const Pixel& p = window.pixels[static_cast<std::size_t>(i)];
    variance += p.sigma * p.sigma / static_cast<float>(window.count);  // They are not independent.
    distance2 = std::min(distance2, p.x * p.x + p.y * p.y);
  }
  const Plane plane = fit_plane(window);
  const bool holds_together =
      plane.at_origin > 0.0F &&
      plane.residual_rms <= kGapSigmas * std::sqrt(variance) + kRoughness * plane.at_origin;
  if (!holds_together) return {};
  const float beyond =
      std::max(0.0F, std::sqrt(distance2) - 1.0F) * (plane.slope + kUnknownSlope * plane.at_origin);
  const float sigma_rho =
      std::sqrt(variance + plane.residual_rms * plane.residual_rms + 0.25F * beyond * beyond);
  const float z = 1.0F / plane.at_origin;
  return {z, sigma_rho * z * z};
}

}  // namespace camvox::depth
