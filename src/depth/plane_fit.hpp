#pragma once

#include <cmath>

#include "camvox/config/target_clones.hpp"
#include "cell_grid.hpp"

namespace camvox::depth {

/// Noise of returns and extrinsics, in the units of the fits.
struct NoiseModel {
  double range_sigma_m = 0.02;
  double angle_sigma_px = 0.84;      ///< Angular noise times the focal length.
  double extrinsics_sigma_px = 0.2;  ///< Rotation of the extrinsics, the same way.
  double extrinsics_sigma_m = 0.002;
  double focal_px = 958.0;
};

/// rho(u, v) = rho + slope_u (u - u_c) + slope_v (v - v_c), fitted to returns around the centre
/// (u_c, v_c) of a cell.
struct PlaneFit {
  double count = 0.0;
  double rho = 0.0;
  double slope_u = 0.0;
  double slope_v = 0.0;
  double sum_squares = 0.0;     ///< Of the residuals.
  double noise_variance = 0.0;  ///< That a return should have about the plane.
  double off_centre2 = 0.0;  ///< Squared distance of the cell's centre from the returns' mean, in
                             ///< standard deviations of their positions.
  double variance = 0.0;     ///< Of rho over the cell: noise through the fit, and extrinsics.
};

/// Returns of a window scatter as the noise says with this prior, in returns.
inline constexpr double kPriorReturns = 6.0;
/// Steepest surface to expect: d rho / d px = this * rho / f (tangent of the incidence angle).
inline constexpr double kSteepest = 20.0;
/// Relief that the returns miss: this share of their noise with so many of them, more with fewer,
/// less with more.
inline constexpr double kRelief = 0.4;
inline constexpr double kReliefReturns = 11.0;
/// Scatter about a plane that is taken for relief, as a share of inverse depth.
inline constexpr double kRough = 0.005;
/// Error of direction that returns of one place have in common (the beam has a width, and the
/// nearer part of a slope answers more strongly), as a share of their noise.
inline constexpr double kPointingBias = 0.3;
/// No surface is flatter than this share of its depth.
inline constexpr double kUnevenness = 0.0005;

/// Least squares for the moments `m` of a window, given the middle of the cell and the cosine of
/// its direction to the optical axis. Straight code: it is inlined into a vectorised loop.
CAMVOX_ALWAYS_INLINE PlaneFit
fit_plane(const double* m, double u_c, double v_c, double cosine, const NoiseModel& noise) {
  PlaneFit fit;
  const double n = m[CellGrid::kN];
  const double inverse_n = 1.0 / (n > 1.0 ? n : 1.0);
  const double u = m[CellGrid::kU] * inverse_n;
  const double v = m[CellGrid::kV] * inverse_n;
  const double r = m[CellGrid::kR] * inverse_n;
  // Stiffness against slopes that no surface has, which also keeps lines of returns solvable.
  const double stiff = (noise.range_sigma_m * r + 1e-4) * noise.focal_px / kSteepest;
  const double uu = m[CellGrid::kUU] - n * u * u + stiff * stiff;
  const double vv = m[CellGrid::kVV] - n * v * v + stiff * stiff;
  const double uv = m[CellGrid::kUV] - n * u * v;
  const double ur = m[CellGrid::kUR] - n * u * r;
  const double vr = m[CellGrid::kVR] - n * v * r;
  const double rr = m[CellGrid::kRR] - n * r * r;
  const double inverse_det = 1.0 / (uu * vv - uv * uv);
  const double gu = (vv * ur - uv * vr) * inverse_det;
  const double gv = (uu * vr - uv * ur) * inverse_det;
  const double du = u_c - u;
  const double dv = v_c - v;
  const double ss = rr - gu * ur - gv * vr;
  const double g2 = gu * gu + gv * gv;
  const double range = noise.range_sigma_m * cosine * r * r;
  const double uneven = kUnevenness * r;
  fit.count = n;
  fit.rho = r + gu * du + gv * dv;
  fit.slope_u = gu;
  fit.slope_v = gv;
  fit.sum_squares = ss > 0.0 ? ss : 0.0;
  fit.noise_variance =
      range * range + uneven * uneven + g2 * noise.angle_sigma_px * noise.angle_sigma_px;
  const double distance2 = (vv * du * du - 2.0 * uv * du * dv + uu * dv * dv) * inverse_det;
  fit.off_centre2 = distance2 * n;
  // Averaged over the cell's pixels: their positions have a variance of kCell^2 / 12 each way.
  const double over_cell = (kCell * kCell / 12.0) * (uu + vv) * inverse_det;
  const double dof = n > 3.0 ? n - 3.0 : 0.0;
  const double scatter =
      (kPriorReturns * fit.noise_variance + fit.sum_squares) / (kPriorReturns + dof);
  const double shift_px =
      noise.extrinsics_sigma_px * noise.extrinsics_sigma_px +
      noise.focal_px * noise.focal_px * noise.extrinsics_sigma_m * noise.extrinsics_sigma_m * r * r;
  const double along = noise.extrinsics_sigma_m * r * r;
  const double pointing = kPointingBias * noise.angle_sigma_px;
  const double excess = fit.sum_squares - dof * fit.noise_variance;
  const double structure = excess > 0.0 ? excess * inverse_n : 0.0;
  const double relief = kRelief * kReliefReturns * inverse_n;
  fit.variance = scatter * (inverse_n + distance2 + over_cell) + structure +
                 relief * relief * fit.noise_variance + along * along +
                 g2 * (shift_px + pointing * pointing);
  return fit;
}

/// Whether the returns scatter about the plane no more than noise lets them (3 sigma of chi^2).
CAMVOX_ALWAYS_INLINE bool agrees_with_noise(const PlaneFit& fit) {
  const double dof = fit.count > 3.0 ? fit.count - 3.0 : 0.0;
  return fit.sum_squares <= fit.noise_variance * (dof + 3.0 * std::sqrt(2.0 * dof));
}

/// Whether the returns scatter so little, for their depth, that looking closer would find nothing
/// but relief, which sigma accounts for.
CAMVOX_ALWAYS_INLINE bool is_even(const PlaneFit& fit) {
  const double bound = kRough * fit.rho;
  return fit.sum_squares <= bound * bound * fit.count;
}

}  // namespace camvox::depth
