#include "camvox/features/undistorter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace camvox::features {
namespace {

using Eigen::Vector2d;
using Eigen::Vector2f;

constexpr double kTolerance_px = 0.01;

/// Weights of four neighbouring nodes for a place t in [0, 1] between the middle ones (cubic
/// Lagrange: exact for polynomials of third degree).
std::array<float, 4> cubic_weights(float t) {
  const float a = t + 1.0F;
  const float b = t - 1.0F;
  const float c = t - 2.0F;
  return {-t * b * c / 6.0F, a * b * c / 2.0F, -a * t * c / 2.0F, a * t * b / 6.0F};
}

bool is_pinhole(const sensors::CameraIntrinsics& intrinsics) {
  return intrinsics.distortion_model != "equidistant" &&
         std::all_of(intrinsics.distortion.begin(), intrinsics.distortion.end(), [](double k) {
           return k == 0.0;
         });
}

}  // namespace

Undistorter::Undistorter(const sensors::CameraModel& camera)
    : camera_(camera), pinhole_(is_pinhole(camera.intrinsics())) {
  if (pinhole_) return;
  columns_ = (camera_.intrinsics().width_px + kSpacing_px - 1) / kSpacing_px;
  rows_ = (camera_.intrinsics().height_px + kSpacing_px - 1) / kSpacing_px;
  fill_table();
  check_cells();
}

std::optional<Vector2d> Undistorter::invert(const Vector2d& u_px) const {
  const sensors::Unprojection ray = camera_.unproject(u_px);
  if (!ray.converged) return std::nullopt;
  const sensors::CameraIntrinsics& k = camera_.intrinsics();
  return Vector2d(k.fx_px * ray.f_camera.x() / ray.f_camera.z() + k.cx_px,
                  k.fy_px * ray.f_camera.y() / ray.f_camera.z() + k.cy_px);
}

void Undistorter::fill_table() {
  for (int r = -1; r <= rows_ + 1; ++r) {
    for (int c = -1; c <= columns_ + 1; ++c) {
      const Vector2d u_px(c * kSpacing_px, r * kSpacing_px);
      const auto straight_px = invert(u_px);
      node_valid_.push_back(straight_px ? 1 : 0);
      shift_px_.push_back(straight_px ? Vector2f((*straight_px - u_px).cast<float>())
                                      : Vector2f(Vector2f::Zero()));
    }
  }
}

void Undistorter::check_cells() {
  const auto node = [&](int r, int c) {
    return static_cast<std::size_t>((r + 1) * (columns_ + 3) + c + 1);
  };
  for (int r = 0; r < rows_; ++r) {
    for (int c = 0; c < columns_; ++c) {
      bool accurate = true;
      for (int i = -1; i <= 2; ++i) {
        for (int j = -1; j <= 2; ++j) accurate = accurate && node_valid_[node(r + i, c + j)] != 0;
      }
      if (accurate) {
        const Vector2d centre_px((c + 0.5) * kSpacing_px, (r + 0.5) * kSpacing_px);
        const auto exact_px = invert(centre_px);
        const Vector2d table_px = interpolate(centre_px.cast<float>()).cast<double>();
        accurate = exact_px && (table_px - *exact_px).norm() < kTolerance_px;
      }
      cell_accurate_.push_back(accurate ? 1 : 0);
    }
  }
}

Vector2f Undistorter::interpolate(const Vector2f& u_px) const {
  const Vector2f place = u_px / static_cast<float>(kSpacing_px);
  const int c = static_cast<int>(place.x());
  const int r = static_cast<int>(place.y());
  const auto wu = cubic_weights(place.x() - static_cast<float>(c));
  const auto wv = cubic_weights(place.y() - static_cast<float>(r));
  Vector2f shift_px = Vector2f::Zero();
  const Vector2f* node = shift_px_.data() + r * (columns_ + 3) + c;  // of row r-1, column c-1
  for (std::size_t i = 0; i < 4; ++i, node += columns_ + 3) {
    shift_px += wv[i] * (wu[0] * node[0] + wu[1] * node[1] + wu[2] * node[2] + wu[3] * node[3]);
  }
  return u_px + shift_px;
}

std::optional<Vector2f> Undistorter::undistort(const Vector2f& u_px) const {
  if (!camera_.contains(u_px.cast<double>(), -0.5)) return std::nullopt;
  if (pinhole_) return u_px;
  const int c = static_cast<int>(u_px.x()) / kSpacing_px;
  const int r = static_cast<int>(u_px.y()) / kSpacing_px;
  const bool in_table = u_px.minCoeff() >= 0.0F && c < columns_ && r < rows_;
  if (in_table && cell_accurate_[static_cast<std::size_t>(r * columns_ + c)] != 0) {
    return interpolate(u_px);
  }
  const auto straight_px = invert(u_px.cast<double>());
  if (!straight_px) return std::nullopt;
  return straight_px->cast<float>();
}

void Undistorter::undistort(FrameFeatures& features) const {
  features.undistorted_px.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const auto straight_px =
        undistort(Vector2f(features.key_points[i].u_px, features.key_points[i].v_px));
    if (!straight_px) continue;
    features.undistorted_px.push_back(*straight_px);
    features.key_points[kept] = features.key_points[i];
    features.descriptors[kept] = features.descriptors[i];
    if (!features.depth_m.empty()) features.depth_m[kept] = features.depth_m[i];
    if (!features.depth_sigma_m.empty()) features.depth_sigma_m[kept] = features.depth_sigma_m[i];
    ++kept;
  }
  features.key_points.resize(kept);
  features.descriptors.resize(kept);
  if (!features.depth_m.empty()) features.depth_m.resize(kept);
  if (!features.depth_sigma_m.empty()) features.depth_sigma_m.resize(kept);
}

double Undistorter::table_share() const {
  if (pinhole_) return 1.0;
  const int accurate = std::accumulate(cell_accurate_.begin(), cell_accurate_.end(), 0);
  return accurate / static_cast<double>(cell_accurate_.size());
}

}  // namespace camvox::features
