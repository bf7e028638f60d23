#include "camvox/loop/surface_registration.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <tuple>

#include "camvox/loop/consistency.hpp"

namespace camvox::loop {
namespace {

using Eigen::Vector2f;
using Eigen::Vector3f;
using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;
constexpr std::size_t kMinUpright = 20;
constexpr int kMinPoints = 100;
constexpr double kWiden = 2.0;      ///< In the end; see linearise().
constexpr std::size_t kStride = 4;  ///< A quarter of the surfaces leads as near as all.
constexpr double kApart_m = 1.0;    ///< So far from each other, two poses are different ones.

/// Where something stands upright, spread a little, seen from above.
class UprightGrid {
 public:
  explicit UprightGrid(const std::vector<Vector2f>& upright) {
    low_ = upright.front();
    Vector2f high = low_;
    for (const auto& cell : upright) {
      low_ = low_.cwiseMin(cell);
      high = high.cwiseMax(cell);
    }
    low_.array() -= SurfaceMap::kCell_m;
    size_ = ((high - low_) / SurfaceMap::kCell_m).array().round().cast<int>() + 2;
    worth_.assign(static_cast<std::size_t>(size_.prod()), 0.0F);
    for (const auto& cell : upright) {
      const Eigen::Vector2i at = ((cell - low_) / SurfaceMap::kCell_m).array().round().cast<int>();
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dy = -1; dy <= 1; ++dy) {
          auto& worth = worth_[index(at.x() + dx, at.y() + dy)];
          worth = std::max(worth, dx == 0 && dy == 0 ? 1.0F : 0.4F);
        }
      }
    }
  }

  [[nodiscard]] float at(const Vector2f& p) const {
    const Eigen::Vector2i at = ((p - low_) / SurfaceMap::kCell_m).array().round().cast<int>();
    const bool inside = (at.array() >= 0).all() && (at.array() < size_.array()).all();
    return inside ? worth_[index(at.x(), at.y())] : 0.0F;
  }

 private:
  [[nodiscard]] std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(i) * static_cast<std::size_t>(size_.y()) +
           static_cast<std::size_t>(j);
  }
  Vector2f low_;
  Eigen::Vector2i size_;
  std::vector<float> worth_;
};

struct Start {
  SE3 T_target_source;
  float worth = 0.0F;
};

/// The best starts that are apart from each other, best first.
std::vector<Start> search(const SurfaceMap& source,
                          const SurfaceMap& target,
                          const RegistrationStart& start,
                          std::size_t count) {
  constexpr double kYawStep_rad = 3.0 * kRadPerDeg;
  const UprightGrid grid(target.upright());
  const int steps = static_cast<int>(std::ceil(start.search_m / SurfaceMap::kCell_m));
  const int turns = static_cast<int>(std::ceil(start.search_yaw_rad / kYawStep_rad));
  std::vector<Start> all;
  std::vector<Vector2f> turned(source.upright().size());
  for (int turn = -turns; turn <= turns; ++turn) {
    const SE3 T = start.T_target_source *
                  SE3(geometry::SO3::exp({0, 0, turn * kYawStep_rad}), Eigen::Vector3d::Zero());
    for (std::size_t i = 0; i < turned.size(); ++i) {
      const auto& cell = source.upright()[i];
      turned[i] = (T * Eigen::Vector3d(cell.x(), cell.y(), 0.0)).head<2>().cast<float>();
    }
    for (int x = -steps; x <= steps; ++x) {
      for (int y = -steps; y <= steps; ++y) {
        const Vector2f shift = SurfaceMap::kCell_m * Vector2f(x, y);
        float worth = 0.0F;
        for (const auto& cell : turned) worth += grid.at(cell + shift);
        all.push_back({SE3(geometry::SO3(), {shift.x(), shift.y(), 0.0}) * T, worth});
      }
    }
  }
  std::stable_sort(
      all.begin(), all.end(), [](const Start& a, const Start& b) { return a.worth > b.worth; });
  std::vector<Start> best;
  for (const auto& candidate : all) {
    if (best.size() >= count) break;
    const auto beside = [&](const Start& other) {
      const auto apart = geometry::local(other.T_target_source, candidate.T_target_source);
      return apart.tail<3>().norm() < kApart_m;
    };
    if (std::none_of(best.begin(), best.end(), beside)) best.push_back(candidate);
  }
  return best;
}

/// Points of one place against the surfaces of another.
class Matching {
 public:
  Matching(const SurfaceMap& source, const SurfaceMap& target, const RegistrationConfig& config)
      : source_(source), target_(target), config_(config) {}

  /// Normal equations in sigma.
  struct Equations {
    Matrix6d H = Matrix6d::Zero();
    Vector6d b = Vector6d::Zero();
    int points = 0;
  };

  /// From where the search got to.
  [[nodiscard]] std::optional<SE3> approach(const SE3& T) const { return refine(T, 8.0, kStride); }
  /// From where approach() got to.
  [[nodiscard]] std::optional<SE3> finish(const SE3& T) const { return refine(T, kWiden, 1); }

  /// Of the pose that was found.
  [[nodiscard]] Equations equations(const SE3& T) const { return linearise(T, kWiden, 1); }

  /// Part of what is rough above the ground that has a point of the target beside it.
  [[nodiscard]] double coincidence(const SE3& T_target_source) const {
    constexpr float kBeside_m = 0.3F;
    const Eigen::Matrix3f R = T_target_source.rotation().matrix().cast<float>();
    const Vector3f t = T_target_source.translation().cast<float>();
    int all = 0;
    int coincide = 0;
    for (const auto& surface : source_.surfaces()) {
      if (!surface.rough() || surface.point.z() < SurfaceMap::kLowest_m) continue;
      ++all;
      coincide += target_.has_within(R * surface.point + t, kBeside_m) ? 1 : 0;
    }
    return all > 0 ? static_cast<double>(coincide) / all : 0.0;
  }

  /// See Registration; one way.
  [[nodiscard]] double distinction(const SE3& T_target_source) const {
    constexpr double kBeside_m = 1.5;
    constexpr int kDirections = 8;
    double beside = 0.0;  // a kerb coincides with itself when it is moved along
    for (int i = 0; i < kDirections; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / kDirections;
      const Eigen::Vector3d shift(kBeside_m * std::cos(angle), kBeside_m * std::sin(angle), 0.0);
      beside = std::max(beside, coincidence(SE3(geometry::SO3(), shift) * T_target_source));
    }
    return coincidence(T_target_source) - beside;
  }

 private:
  /// `widen`: what is farther off than so many sigma hardly counts (Geman, McClure). Every
  /// `stride`th surface counts.
  [[nodiscard]] Equations linearise(const SE3& T_target_source,
                                    double widen,
                                    std::size_t stride) const {
    Equations sum;
    const Eigen::Matrix3d R = T_target_source.rotation().matrix();
    for (std::size_t i = 0; i < source_.surfaces().size(); i += stride) {
      const auto& surface = source_.surfaces()[i];
      const Eigen::Vector3d p_source = surface.point.cast<double>();
      const Eigen::Vector3d p = R * p_source + T_target_source.translation();
      const auto* near = target_.nearest(p.cast<float>());
      if (near == nullptr || near->rough() != surface.rough()) continue;
      const Eigen::Vector3d difference = p - near->point.cast<double>();
      ++sum.points;
      const auto add = [&](const Eigen::Vector3d& n_source, double r, double weight) {
        Vector6d J;
        J << p_source.cross(n_source), n_source;
        sum.H.noalias() += weight * J * J.transpose();
        sum.b.noalias() += weight * r * J;
      };
      if (surface.rough()) {
        const double weight = robust(difference.norm(), config_.point_sigma_m, widen);
        for (int axis = 0; axis < 3; ++axis) {
          add(R.row(axis).transpose(), difference[axis], weight);
        }
      } else {
        const Eigen::Vector3d n = near->normal.cast<double>();
        const double r = n.dot(difference);
        add(R.transpose() * n, r, robust(r, config_.plane_sigma_m, widen));
      }
    }
    return sum;
  }

  [[nodiscard]] std::optional<SE3> refine(SE3 T, double widen, std::size_t stride) const {
    for (int i = 0; i < config_.max_iterations; ++i) {
      auto equations = linearise(T, widen, stride);
      if (equations.points * static_cast<int>(stride) < kMinPoints) return std::nullopt;
      equations.H.diagonal().array() += 1e-3 * equations.points;  // where nothing holds
      const Vector6d step = -equations.H.ldlt().solve(equations.b);
      if (!step.allFinite()) return std::nullopt;
      T = geometry::retract(T, step);
      const bool stays = step.head<3>().norm() < 2e-4 && step.tail<3>().norm() < 2e-3;
      if (stays && widen <= kWiden) break;
      widen = std::max(0.7 * widen, kWiden);
    }
    return T;
  }

  static double robust(double r, double sigma, double widen) {
    const double width2 = widen * widen * sigma * sigma;
    const double scale = width2 / (width2 + r * r);
    return scale * scale / (sigma * sigma);
  }

  const SurfaceMap& source_;
  const SurfaceMap& target_;
  const RegistrationConfig& config_;
};

RegistrationStatus judge(const Registration& result, const RegistrationConfig& config) {
  const double needed = std::max(config.min_distinction, result.runner_up / config.max_runner_up);
  if (result.distinction < needed) return RegistrationStatus::kNotDistinct;
  const auto sigma = largest_sigma(result.covariance_source);
  const bool certain = sigma.rotation_rad < config.max_rotation_sigma_deg * kRadPerDeg &&
                       sigma.translation_m < config.max_translation_sigma_m;
  return certain ? RegistrationStatus::kOk : RegistrationStatus::kUncertain;
}

}  // namespace

Registration register_surfaces(const SurfaceMap& source,
                               const SurfaceMap& target,
                               const RegistrationStart& start,
                               const RegistrationConfig& config) {
  Registration result;
  if (source.upright().size() < kMinUpright || target.upright().size() < kMinUpright) return result;
  const Matching there(source, target, config);
  const Matching back(target, source, config);
  std::vector<std::pair<double, SE3>> refined;
  for (const auto& from : search(source, target, start, static_cast<std::size_t>(config.starts))) {
    const auto T = there.approach(from.T_target_source);
    if (!T) continue;
    refined.emplace_back(0.5 * (there.distinction(*T) + back.distinction(T->inverse())), *T);
  }
  if (refined.empty()) return result;
  std::stable_sort(refined.begin(), refined.end(), [](const auto& a, const auto& b) {
    return a.first > b.first;
  });
  std::tie(result.distinction, result.T_target_source) = refined.front();
  for (const auto& [distinction, T] : refined) {
    const auto apart = geometry::local(result.T_target_source, T);
    if (apart.tail<3>().norm() < kApart_m) continue;
    result.runner_up = std::max(result.runner_up, distinction);
  }
  if (const auto T = there.finish(result.T_target_source)) result.T_target_source = *T;
  const auto equations = there.equations(result.T_target_source);
  result.points = equations.points;
  const Matrix6d H = equations.H + 1e-6 * Matrix6d::Identity();  // may hold some way not at all
  result.covariance_source = config.repeated_points * H.ldlt().solve(Matrix6d::Identity());
  result.status = judge(result, config);
  return result;
}

}  // namespace camvox::loop
