#include "camvox/loop/surface_map.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

namespace camvox::loop {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr float kLevel_m = 0.3F;
constexpr int kUprightLevels = 3;  ///< What reaches over so many levels is upright.
constexpr int kMinNeighbours = 6;
constexpr float kMaxRoughness_m = 0.06F;
constexpr float kMaxFlatRatio = 0.15F;  ///< Of the thinnest to the second extent, squared.

}  // namespace

SurfaceMap::SurfaceMap(const std::vector<Vector3f>& points_level) {
  if (points_level.empty()) return;
  low_ = points_level.front();
  Vector3f high = low_;
  for (const auto& point : points_level) {
    low_ = low_.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  size_ = index_of(high) + Vector3i::Ones();
  std::vector<std::pair<std::size_t, std::uint32_t>> order;
  for (std::uint32_t i = 0; i < points_level.size(); ++i) {
    order.emplace_back(cell(index_of(points_level[i])), i);
  }
  std::sort(order.begin(), order.end());
  begin_.assign(cell(size_ - Vector3i::Ones()) + 2, 0);
  for (const auto& [where, i] : order) {
    ++begin_[where + 1];
    surfaces_.push_back({points_level[i], Vector3f::Zero()});
  }
  for (std::size_t i = 1; i < begin_.size(); ++i) begin_[i] += begin_[i - 1];
  for (auto& surface : surfaces_) surface.normal = normal_at(surface.point);
  find_upright();
}

Vector3i SurfaceMap::index_of(const Vector3f& point) const {
  return ((point - low_) / kNear_m).array().floor().cast<int>();
}

std::size_t SurfaceMap::cell(const Vector3i& index) const {
  const Eigen::Matrix<std::size_t, 3, 1> at = index.cast<std::size_t>();
  const Eigen::Matrix<std::size_t, 3, 1> size = size_.cast<std::size_t>();
  return (at.x() * size.y() + at.y()) * size.z() + at.z();
}

/// Calls `use` with every surface within `radius_m` and the vector to it, until it returns true.
template <typename Use>
bool SurfaceMap::for_near(const Vector3f& point, float radius_m, Use use) const {
  const Vector3f reach = Vector3f::Constant(radius_m);
  const Vector3i low = index_of(point - reach).cwiseMax(0);
  const Vector3i high = index_of(point + reach).cwiseMin(size_ - Vector3i::Ones());
  if ((low.array() > high.array()).any()) return false;
  for (int x = low.x(); x <= high.x(); ++x) {
    for (int y = low.y(); y <= high.y(); ++y) {
      // Cells above each other follow each other.
      const auto last = begin_[cell({x, y, high.z()}) + 1];
      for (auto i = begin_[cell({x, y, low.z()})]; i < last; ++i) {
        const Vector3f d = surfaces_[i].point - point;
        if (d.squaredNorm() < radius_m * radius_m && use(surfaces_[i], d)) return true;
      }
    }
  }
  return false;
}

const SurfaceMap::Surface* SurfaceMap::nearest(const Vector3f& point) const {
  const Surface* best = nullptr;
  float best_m2 = kNear_m * kNear_m;
  for_near(point, kNear_m, [&](const Surface& surface, const Vector3f& d) {
    if (d.squaredNorm() < best_m2) {
      best_m2 = d.squaredNorm();
      best = &surface;
    }
    return false;
  });
  return best;
}

bool SurfaceMap::has_within(const Vector3f& point, float radius_m) const {
  return for_near(point, radius_m, [](const Surface&, const Vector3f&) { return true; });
}

Vector3f SurfaceMap::normal_at(const Vector3f& point) const {
  Vector3f sum = Vector3f::Zero();
  Eigen::Matrix3f squares = Eigen::Matrix3f::Zero();
  int count = 0;
  for_near(point, kNear_m, [&](const Surface& /*surface*/, const Vector3f& d) {
    sum += d;
    squares += d * d.transpose();
    ++count;
    return false;
  });
  if (count < kMinNeighbours) return Vector3f::Zero();
  const auto n = static_cast<float>(count);
  const Eigen::Matrix3f covariance = squares / n - sum * sum.transpose() / (n * n);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> solver;
  solver.computeDirect(covariance);
  const auto& extents = solver.eigenvalues();
  const bool flat =
      extents[0] < kMaxRoughness_m * kMaxRoughness_m && extents[0] < kMaxFlatRatio * extents[1];
  return flat ? Vector3f(solver.eigenvectors().col(0)) : Vector3f::Zero();
}

void SurfaceMap::find_upright() {
  std::map<std::pair<int, int>, std::uint32_t> levels;
  for (const auto& surface : surfaces_) {
    const int level = static_cast<int>(std::floor((surface.point.z() - kLowest_m) / kLevel_m));
    if (level < 0 || level > 31) continue;
    levels[{static_cast<int>(std::floor(surface.point.x() / kCell_m)),
            static_cast<int>(std::floor(surface.point.y() / kCell_m))}] |=
        1U << static_cast<unsigned>(level);
  }
  for (const auto& [cell, mask] : levels) {
    if (std::popcount(mask) < kUprightLevels) continue;
    upright_.emplace_back((static_cast<float>(cell.first) + 0.5F) * kCell_m,
                          (static_cast<float>(cell.second) + 0.5F) * kCell_m);
  }
}

}  // namespace camvox::loop
