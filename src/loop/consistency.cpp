#include "camvox/loop/consistency.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

namespace camvox::loop {
namespace {

using geometry::Matrix6d;
using geometry::SE3;
using geometry::Vector6d;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

/// Whether an error of a pose lies inside the gate of its covariance.
bool inside(const Vector6d& error, const Matrix6d& covariance, double gate_sigma) {
  const double squared = error.dot(covariance.llt().solve(error));
  return squared <= gate_sigma * gate_sigma;
}

/// Of a measurement, never smaller than what neighbours in the map are worth.
Matrix6d measurement_covariance(const LoopMeasurement& measurement, const DriftConfig& config) {
  return measurement.covariance_query + path_sigma(0.0, config).covariance();
}

class CliqueSearch {
 public:
  CliqueSearch(const std::vector<std::vector<bool>>& adjacent, std::size_t max_steps)
      : adjacent_(adjacent), steps_left_(max_steps) {}

  std::vector<std::size_t> run() {
    std::vector<std::size_t> all(adjacent_.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<std::size_t> degrees;
    for (const auto& row : adjacent_) {
      degrees.push_back(static_cast<std::size_t>(std::count(row.begin(), row.end(), true)));
    }
    std::stable_sort(all.begin(), all.end(), [&](std::size_t a, std::size_t b) {
      return degrees[a] > degrees[b];
    });
    expand(all);
    std::sort(best_.begin(), best_.end());
    return best_;
  }

 private:
  /// Orders the candidates by colour; a clique has at most one vertex of each.
  std::vector<std::size_t> colour(std::vector<std::size_t>& candidates) const {
    std::vector<std::vector<std::size_t>> classes;
    for (const auto vertex : candidates) {
      const auto fits = [&](const std::vector<std::size_t>& members) {
        return std::none_of(members.begin(), members.end(), [&](std::size_t other) {
          return adjacent_[vertex][other];
        });
      };
      const auto found = std::find_if(classes.begin(), classes.end(), fits);
      if (found == classes.end()) {
        classes.push_back({vertex});
      } else {
        found->push_back(vertex);
      }
    }
    candidates.clear();
    std::vector<std::size_t> colours;
    for (std::size_t c = 0; c < classes.size(); ++c) {
      for (const auto vertex : classes[c]) {
        candidates.push_back(vertex);
        colours.push_back(c + 1);
      }
    }
    return colours;
  }

  void expand(std::vector<std::size_t> candidates) {
    const auto colours = colour(candidates);
    for (std::size_t i = candidates.size(); i-- > 0;) {
      if (current_.size() + colours[i] <= best_.size() || steps_left_ == 0) return;
      --steps_left_;
      const auto vertex = candidates[i];
      std::vector<std::size_t> next;
      for (std::size_t k = 0; k < i; ++k) {
        if (adjacent_[vertex][candidates[k]]) next.push_back(candidates[k]);
      }
      current_.push_back(vertex);
      if (current_.size() > best_.size()) best_ = current_;
      if (!next.empty()) expand(std::move(next));
      current_.pop_back();
    }
  }

  const std::vector<std::vector<bool>>& adjacent_;
  std::size_t steps_left_;
  std::vector<std::size_t> current_;
  std::vector<std::size_t> best_;
};

}  // namespace

Matrix6d PoseSigma::covariance() const {
  Vector6d variance;
  variance.head<3>().setConstant(rotation_rad * rotation_rad);
  variance.tail<3>().setConstant(translation_m * translation_m);
  return variance.asDiagonal();
}

PoseSigma largest_sigma(const Matrix6d& covariance) {
  return {std::sqrt(covariance.diagonal().head<3>().maxCoeff()),
          std::sqrt(covariance.diagonal().tail<3>().maxCoeff())};
}

PoseSigma path_sigma(double length_m, const DriftConfig& config) {
  return {kRadPerDeg * (config.base_sigma_deg + config.sigma_deg_per_m * length_m),
          config.base_sigma_m + config.sigma_m_per_m * length_m};
}

bool consistent(const LoopPair& pair, const DriftConfig& config) {
  const SE3 T_query_a_match_a = pair.a->T_match_query.inverse();
  const SE3 T_match_b_query_a = pair.b->T_match_query * pair.T_query_a_query_b.inverse();
  const Vector6d error = (T_query_a_match_a * pair.T_match_a_match_b * T_match_b_query_a).log();
  // Every part brought to the frame of query a: a rotation there moves the far end by its distance.
  const auto at_query_a = [](const Matrix6d& covariance, const SE3& T_query_a_part) -> Matrix6d {
    const Matrix6d adjoint = T_query_a_part.adjoint();
    return adjoint * covariance * adjoint.transpose();
  };
  const Matrix6d covariance =
      measurement_covariance(*pair.a, config) +
      at_query_a(measurement_covariance(*pair.b, config), pair.T_query_a_query_b) +
      at_query_a(path_sigma(pair.match_path_m, config).covariance(),
                 T_query_a_match_a * pair.T_match_a_match_b) +
      path_sigma(pair.query_path_m, config).covariance();
  return inside(error, covariance, config.gate_sigma);
}

bool plausible(const LoopMeasurement& measurement,
               const SE3& T_match_query_in_map,
               double path_m,
               const DriftConfig& config) {
  const Vector6d error = geometry::local(T_match_query_in_map, measurement.T_match_query);
  const Matrix6d covariance =
      measurement_covariance(measurement, config) + path_sigma(path_m, config).covariance();
  return inside(error, covariance, config.gate_sigma);
}

std::vector<std::size_t> maximum_clique(const std::vector<std::vector<bool>>& adjacent,
                                        std::size_t max_steps) {
  if (adjacent.empty()) return {};
  return CliqueSearch(adjacent, max_steps).run();
}

}  // namespace camvox::loop
