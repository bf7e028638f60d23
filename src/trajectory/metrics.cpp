#include "camvox/trajectory/metrics.hpp"

#include <algorithm>
#include <cmath>

namespace camvox::trajectory {
namespace {

constexpr double kDegrees = 57.295779513082320877;

RelativeError relative_error(const std::vector<PosePair>& pairs,
                             std::size_t from,
                             std::size_t to,
                             double length_m) {
  const auto motion = [&](auto member) {
    return (pairs[from].*member).T_world_body.inverse() * (pairs[to].*member).T_world_body;
  };
  const geometry::SE3 error = motion(&PosePair::reference).inverse() * motion(&PosePair::estimate);
  return {from, to, length_m, error.translation().norm(), error.rotation().angle_rad()};
}

/// Path driven up to each pair.
std::vector<double> distances_m(const std::vector<PosePair>& pairs, StampedPose PosePair::*member) {
  std::vector<double> distances(pairs.size(), 0.0);
  for (std::size_t i = 1; i < pairs.size(); ++i) {
    distances[i] = distances[i - 1] + ((pairs[i].*member).T_world_body.translation() -
                                       (pairs[i - 1].*member).T_world_body.translation())
                                          .norm();
  }
  return distances;
}

}  // namespace

Statistics statistics(std::vector<double> errors) {
  Statistics result;
  result.count = errors.size();
  if (errors.empty()) return result;
  std::sort(errors.begin(), errors.end());
  const auto count = static_cast<double>(errors.size());
  double sum = 0.0;
  for (const double error : errors) {
    sum += error;
    result.sse += error * error;
  }
  result.min = errors.front();
  result.max = errors.back();
  result.mean = sum / count;
  const std::size_t middle = errors.size() / 2;
  result.median =
      errors.size() % 2 == 1 ? errors[middle] : 0.5 * (errors[middle - 1] + errors[middle]);
  result.rmse = std::sqrt(result.sse / count);
  double squares = 0.0;
  for (const double error : errors) squares += (error - result.mean) * (error - result.mean);
  result.std = std::sqrt(squares / count);
  return result;
}

std::vector<double> absolute_errors_m(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const auto& [reference, estimate] : pairs) {
    errors.push_back(
        (reference.T_world_body.translation() - estimate.T_world_body.translation()).norm());
  }
  return errors;
}

std::vector<double> absolute_errors_rad(const std::vector<PosePair>& pairs) {
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const auto& [reference, estimate] : pairs) {
    errors.push_back(
        (reference.T_world_body.rotation().inverse() * estimate.T_world_body.rotation())
            .angle_rad());
  }
  return errors;
}

std::vector<RelativeError> relative_errors_by_path(const std::vector<PosePair>& pairs,
                                                   double delta_m) {
  const auto estimated_m = distances_m(pairs, &PosePair::estimate);
  const auto driven_m = distances_m(pairs, &PosePair::reference);
  std::vector<RelativeError> errors;
  std::size_t from = 0;
  for (std::size_t to = 1; to < pairs.size(); ++to) {
    if (estimated_m[to] - estimated_m[from] < delta_m) continue;
    if (from > 0) errors.push_back(relative_error(pairs, from, to, driven_m[to] - driven_m[from]));
    from = to;
  }
  return errors;
}

std::vector<RelativeError> relative_errors_by_frames(const std::vector<PosePair>& pairs,
                                                     std::size_t frames) {
  const auto driven_m = distances_m(pairs, &PosePair::reference);
  std::vector<RelativeError> errors;
  for (std::size_t from = 0; frames > 0 && from + frames < pairs.size(); from += frames) {
    const std::size_t to = from + frames;
    errors.push_back(relative_error(pairs, from, to, driven_m[to] - driven_m[from]));
  }
  return errors;
}

std::vector<RelativeError> revisit_errors(const std::vector<PosePair>& pairs,
                                          const RevisitRule& rule) {
  const auto driven_m = distances_m(pairs, &PosePair::reference);
  std::vector<RelativeError> errors;
  for (std::size_t to = 0; to < pairs.size(); ++to) {
    const geometry::SE3& T_to = pairs[to].reference.T_world_body;
    double nearest_m = rule.max_distance_m;
    std::optional<std::size_t> nearest;
    for (std::size_t from = 0; driven_m[to] - driven_m[from] > rule.min_travel_m; ++from) {
      const geometry::SE3& T_from = pairs[from].reference.T_world_body;
      const double distance_m = (T_to.translation() - T_from.translation()).norm();
      if (distance_m > nearest_m) continue;
      if ((T_from.rotation().inverse() * T_to.rotation()).angle_rad() > rule.max_turn_rad) continue;
      nearest_m = distance_m;
      nearest = from;
    }
    if (nearest) {
      errors.push_back(relative_error(pairs, *nearest, to, driven_m[to] - driven_m[*nearest]));
    }
  }
  return errors;
}

std::optional<KittiErrors> kitti_errors(const std::vector<PosePair>& pairs,
                                        const std::vector<double>& lengths_m) {
  const auto driven_m = distances_m(pairs, &PosePair::reference);
  KittiErrors sum;
  for (std::size_t from = 0; from < pairs.size(); from += 10) {
    for (const double length_m : lengths_m) {
      const auto end =
          std::upper_bound(driven_m.begin(), driven_m.end(), driven_m[from] + length_m);
      if (end == driven_m.end()) continue;
      const auto to = static_cast<std::size_t>(end - driven_m.begin());
      const auto error = relative_error(pairs, from, to, length_m);
      sum.t_rel_percent += 100.0 * error.translation_m / length_m;
      sum.r_rel_deg_per_100m += 100.0 * kDegrees * error.rotation_rad / length_m;
      ++sum.stretches;
    }
  }
  if (sum.stretches == 0) return std::nullopt;
  sum.t_rel_percent /= static_cast<double>(sum.stretches);
  sum.r_rel_deg_per_100m /= static_cast<double>(sum.stretches);
  return sum;
}

}  // namespace camvox::trajectory
