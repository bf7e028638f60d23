#include "point_projection.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>

#include "camvox/config/target_clones.hpp"
#include "camvox/sensors/distortion.hpp"

namespace camvox::depth {
namespace {

constexpr std::size_t kBlock = 256;
constexpr std::size_t kTableSize = 8192;
/// Nearer to the camera's plane a point has no pixel.
constexpr float kMinDepth_m = 0.05F;
/// The squared tangent of 85 degrees. The table has equal steps of it, which at 90 degrees would be
/// without bound; up to here they are fine enough for the 0.01 px.
constexpr double kMaxRadius2 = 130.6;

/// The largest squared radius of a direction whose pixel is in the image or within the margin;
/// kMaxRadius2 where the border lies beyond what the lens shows.
double largest_radius2(const sensors::CameraModel& camera, double margin_px) {
  const auto& intrinsics = camera.intrinsics();
  double largest = 0.0;
  constexpr int kSteps = 32;
  const double width = intrinsics.width_px + 2.0 * margin_px;
  const double height = intrinsics.height_px + 2.0 * margin_px;
  const auto look = [&](double across, double along) {
    const auto view = camera.unproject({across * width - margin_px, along * height - margin_px});
    const Eigen::Vector3d& f = view.f_camera;
    const double radius2 = f.head<2>().squaredNorm() / (f.z() * f.z());
    largest = std::max(largest, view.converged ? radius2 : kMaxRadius2);
  };
  for (int i = 0; i <= kSteps; ++i) {
    for (const double side : {0.0, 1.0}) {
      look(static_cast<double>(i) / kSteps, side);
      look(side, static_cast<double>(i) / kSteps);
    }
  }
  return largest;
}

}  // namespace

void ProjectedPoints::resize(std::size_t count) {
  for (auto* list : lists()) list->resize(count);
}

struct PointProjection::Block {
  std::array<float, kBlock> u, v, rho, shift_u, shift_v;
  std::array<int, kBlock> kept;
};

/// What the inner loop needs, by value, so that the compiler can keep it in registers.
struct PointProjection::Lens {
  const Entry* radial;
  float scale, last, max_radius2, p1, p2, fx, fy, cx, cy;
  float u_min, u_max, v_min, v_max, min_range2, max_range2;
};

PointProjection::PointProjection(const sensors::CameraModel& camera,
                                 const ProjectionBounds& bounds) {
  const auto& intrinsics = camera.intrinsics();
  fx_ = static_cast<float>(intrinsics.fx_px);
  fy_ = static_cast<float>(intrinsics.fy_px);
  cx_ = static_cast<float>(intrinsics.cx_px);
  cy_ = static_cast<float>(intrinsics.cy_px);
  u_min_ = -bounds.margin_px;
  v_min_ = -bounds.margin_px;
  u_max_ = static_cast<float>(intrinsics.width_px - 1) + bounds.margin_px;
  v_max_ = static_cast<float>(intrinsics.height_px - 1) + bounds.margin_px;
  min_range2_ = bounds.min_range_m * bounds.min_range_m;
  max_range2_ = bounds.max_range_m * bounds.max_range_m;
  // Tangential terms stay outside the table: it holds what depends on the radius alone.
  auto coefficients = intrinsics.distortion;
  coefficients.resize(8, 0.0);
  if (intrinsics.distortion_model != "equidistant") {
    p1_ = static_cast<float>(std::exchange(coefficients[2], 0.0));
    p2_ = static_cast<float>(std::exchange(coefficients[3], 0.0));
  }
  const sensors::Distortion radial(intrinsics.distortion_model, coefficients);
  double limit = std::min(1.02 * largest_radius2(camera, bounds.margin_px), kMaxRadius2);
  const sensors::Distortion whole(intrinsics.distortion_model, intrinsics.distortion);
  limit = std::min(limit, whole.max_radius() * whole.max_radius());
  max_radius2_ = static_cast<float>(limit);
  entries_per_radius2_ = static_cast<float>((kTableSize - 2) / limit);
  const auto factor = [&](std::size_t i) {
    const double radius =
        std::sqrt(std::max(1e-12, static_cast<double>(i) * limit / (kTableSize - 2)));
    return radial.apply({radius, 0.0}).x() / radius;
  };
  for (std::size_t i = 0; i < kTableSize; ++i) {
    const double value = factor(i);
    radial_.push_back({static_cast<float>(value), static_cast<float>(factor(i + 1) - value)});
  }
}

// Function-local constants only: the loop vectorises where the processor can gather.
CAMVOX_TARGET_CLONES
void PointProjection::project_block(const float* points,
                                    std::size_t count,
                                    const float* T,
                                    Block& block) const {
  const Lens lens{radial_.data(),
                  entries_per_radius2_,
                  static_cast<float>(kTableSize - 2),
                  max_radius2_,
                  p1_,
                  p2_,
                  fx_,
                  fy_,
                  cx_,
                  cy_,
                  u_min_,
                  u_max_,
                  v_min_,
                  v_max_,
                  min_range2_,
                  max_range2_};
  for (std::size_t i = 0; i < count; ++i) {
    const float px = points[4 * i];
    const float py = points[4 * i + 1];
    const float pz = points[4 * i + 2];
    // The camera's axes, seen from the lidar first, then moved to the camera.
    const float lx = T[0] * px + T[1] * py + T[2] * pz;
    const float ly = T[4] * px + T[5] * py + T[6] * pz;
    const float lz = T[8] * px + T[9] * py + T[10] * pz;
    const float x = lx + T[3];
    const float y = ly + T[7];
    const float z = lz + T[11];
    const float inverse_z = 1.0F / z;
    const float inverse_lz = 1.0F / (lz > kMinDepth_m ? lz : kMinDepth_m);
    const float xn = x * inverse_z;
    const float yn = y * inverse_z;
    const float r2 = xn * xn + yn * yn;
    float place = r2 * lens.scale;
    place = place < lens.last ? place : lens.last;
    const int entry = static_cast<int>(place);
    const float factor =
        lens.radial[entry].value + (place - static_cast<float>(entry)) * lens.radial[entry].step;
    const float xy2 = 2.0F * xn * yn;
    const float u =
        lens.fx * (xn * factor + lens.p1 * xy2 + lens.p2 * (r2 + 2.0F * xn * xn)) + lens.cx;
    const float v =
        lens.fy * (yn * factor + lens.p1 * (r2 + 2.0F * yn * yn) + lens.p2 * xy2) + lens.cy;
    const float range2 = px * px + py * py + pz * pz;
    block.u[i] = u;
    block.v[i] = v;
    block.rho[i] = inverse_z;
    block.shift_u[i] = lens.fx * (xn - lx * inverse_lz);
    block.shift_v[i] = lens.fy * (yn - ly * inverse_lz);
    // One comparison each, all false for NaN; no short cuts, which would keep it from vectorising.
    block.kept[i] = static_cast<int>(z > kMinDepth_m) & static_cast<int>(r2 < lens.max_radius2) &
                    static_cast<int>(range2 >= lens.min_range2) &
                    static_cast<int>(range2 <= lens.max_range2) &
                    static_cast<int>(u >= lens.u_min) & static_cast<int>(u <= lens.u_max) &
                    static_cast<int>(v >= lens.v_min) & static_cast<int>(v <= lens.v_max);
  }
}

void PointProjection::append(std::span<const float> points_lidar,
                             const geometry::SE3& T_camera_lidar,
                             ProjectedPoints& points) const {
  const Eigen::Matrix<float, 3, 4, Eigen::RowMajor> T =
      T_camera_lidar.matrix().topRows<3>().cast<float>();
  const std::size_t count = points_lidar.size() / 4;
  std::size_t end = points.size();
  points.resize(end + count);
  Block block;
  for (std::size_t begin = 0; begin < count; begin += kBlock) {
    const std::size_t length = std::min(kBlock, count - begin);
    project_block(&points_lidar[4 * begin], length, T.data(), block);
    for (std::size_t i = 0; i < length; ++i) {
      points.u_px[end] = block.u[i];
      points.v_px[end] = block.v[i];
      points.rho[end] = block.rho[i];
      points.shift_u_px[end] = block.shift_u[i];
      points.shift_v_px[end] = block.shift_v[i];
      end += static_cast<std::size_t>(block.kept[i]);  // The next one overwrites what is not kept.
    }
  }
  points.resize(end);
}

}  // namespace camvox::depth
