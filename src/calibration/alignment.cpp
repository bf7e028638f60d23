#include "alignment.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace camvox::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::SE3;
using geometry::Vector6d;

constexpr float kOutlierShare = 0.3F;
constexpr int kMaxSteps = 12;
constexpr std::size_t kSearchEdges = 1200;  ///< Enough for the grid, all scenes together.

bool selected(const PreparedScene& scene, std::size_t edge, Part part) {
  return part == Part::kAll || scene.parts[edge] == part;
}

float gain_over_chance(float density) {
  return std::log(kOutlierShare + (1.0F - kOutlierShare) * density);
}

/// A lidar edge in the image.
struct ProjectedEdge {
  Vector2d u_px;
  Vector2d normal;
  Eigen::Matrix<double, 1, 8> J;  ///< Of the position across the edge; see Vector8d.
};

std::optional<ProjectedEdge> project(const sensors::CameraModel& camera,
                                     const Fit& fit,
                                     const Eigen::Matrix3d& R_camera_lidar,
                                     const LidarEdge& edge) {
  const Vector3d p_lidar = edge.p_lidar - edge.widening_lidar * fit.widening_rad;
  const Vector3d p_camera = R_camera_lidar * p_lidar + fit.T_camera_lidar.translation();
  const auto projection = camera.project_with_jacobian(p_camera);
  if (!projection || !camera.contains(projection->u_px, 2.0)) return std::nullopt;
  const Vector2d tangent = projection->J_point * (R_camera_lidar * edge.tangent_lidar);
  const double length = tangent.norm();
  if (!(length > 1e-9)) return std::nullopt;
  const Vector2d normal(-tangent.y() / length, tangent.x() / length);
  const Eigen::RowVector3d J_point = normal.transpose() * projection->J_point * R_camera_lidar;
  ProjectedEdge projected{projection->u_px, normal, {}};
  projected.J.head<3>() = -J_point * geometry::skew(p_lidar);
  projected.J.segment<3>(3) = J_point;
  projected.J.tail<2>() = -J_point * edge.widening_lidar;
  return projected;
}

/// The mean position of contrast across an edge, weighted by a window; and how far it stands out.
struct Match {
  double offset_px = 0.0;
  double quality = 0.0;
};

Match match_contrast(const ImageEdges& image, const ProjectedEdge& edge, double reach_px) {
  // Two sigmas of the window on each side, in steps of a pixel or of a fifth of the window.
  const double step = std::max(1.0, reach_px / 3.0);
  const int steps = static_cast<int>(std::ceil(2.0 * reach_px / step));
  double sum = 0.0;
  double moment = 0.0;
  double window_sum = 0.0;
  for (int k = -steps; k <= steps; ++k) {
    const double offset = k * step;
    const auto contrast =
        static_cast<double>(image.contrast(edge.u_px + offset * edge.normal, edge.normal));
    const double window = std::exp(-0.5 * offset * offset / (reach_px * reach_px));
    const double weight = window * contrast * contrast;
    sum += weight;
    moment += weight * offset;
    window_sum += window;
  }
  if (!(sum > 0.0)) return {};
  const double mean = sum / window_sum;
  return {moment / sum, mean / (mean + 0.05)};
}

/// A weighted mean, and its standard error from the spread over tiles.
class TileMean {
 public:
  void start_scene(std::size_t tiles) {
    first_ = tiles_.size();
    tiles_.resize(first_ + tiles);
  }
  void add(std::size_t tile, double weight, double value) {
    tiles_[first_ + tile].weight += weight;
    tiles_[first_ + tile].sum += weight * value;
  }
  [[nodiscard]] Gain result() const {
    double weight = 0.0;
    double sum = 0.0;
    double used = 0.0;
    for (const Tile& tile : tiles_) {
      weight += tile.weight;
      sum += tile.sum;
      used += tile.weight > 0.0 ? 1.0 : 0.0;
    }
    if (!(used > 1.0)) return {};
    const double mean = sum / weight;
    double squares = 0.0;
    for (const Tile& tile : tiles_) squares += std::pow(tile.sum - mean * tile.weight, 2);
    return {mean, std::sqrt(squares * used / (used - 1.0)) / weight};
  }

 private:
  struct Tile {
    double weight = 0.0;
    double sum = 0.0;
  };
  std::vector<Tile> tiles_;
  std::size_t first_ = 0;
};

}  // namespace

double Alignment::score(const SE3& T_camera_lidar, std::size_t level, Part part) const {
  return climb_equations(T_camera_lidar, level, part).score;
}

NormalEquations Alignment::climb_equations(const SE3& T_camera_lidar,
                                           std::size_t level,
                                           Part part) const {
  const Eigen::Matrix3d R = T_camera_lidar.rotation().matrix();
  NormalEquations equations;
  for (const PreparedScene& scene : scenes_) {
    const EdgeField& field = scene.fields[level];
    const double sigma2 = field.sigma_px() * field.sigma_px();
    for (std::size_t i = 0; i < scene.lidar.edges.size(); ++i) {
      if (!selected(scene, i, part)) continue;
      const LidarEdge& lidar_edge = scene.lidar.edges[i];
      const auto weight = static_cast<double>(lidar_edge.strength);
      equations.weight += weight;
      const auto edge = project(camera_, {T_camera_lidar}, R, lidar_edge);
      if (!edge) {
        equations.score += weight * static_cast<double>(gain_over_chance(0.0F));
        continue;
      }
      const FieldSample sample = field.sample(edge->u_px, edge->normal);
      equations.score += weight * static_cast<double>(gain_over_chance(sample.density));
      if (!(sample.density > 1e-6F)) continue;
      const double hit = (1.0F - kOutlierShare) * sample.density;
      const double w = weight * hit / (static_cast<double>(kOutlierShare) + hit);
      const double slope = sample.slope_px.cast<double>().dot(edge->normal);
      const double offset = sigma2 * slope / static_cast<double>(sample.density);
      const Vector6d J = edge->J.leftCols<6>().transpose();
      equations.H.topLeftCorner<6, 6>() += w * J * J.transpose();
      equations.b.head<6>() += w * offset * J;
      equations.inlier_weight += w;
      equations.squared_error_px2 += w * offset * offset;
    }
  }
  if (equations.weight > 0.0) equations.score /= equations.weight;
  return equations;
}

std::vector<SE3> Alignment::search(const SE3& T_camera_lidar,
                                   double reach_rad,
                                   std::size_t count,
                                   const std::stop_token& stop) const {
  struct Point {
    const EdgeField* field;
    Vector3d p_camera;  ///< Without the translation.
    Vector2d normal;
    float weight;
  };
  const Eigen::Matrix3d R = T_camera_lidar.rotation().matrix();
  std::vector<Point> points;
  std::size_t total = 0;
  for (const PreparedScene& scene : scenes_) total += scene.lidar.edges.size();
  const std::size_t stride = std::max<std::size_t>(1, total / kSearchEdges);
  for (const PreparedScene& scene : scenes_) {
    for (std::size_t i = 0; i < scene.lidar.edges.size(); i += stride) {
      const LidarEdge& edge = scene.lidar.edges[i];
      const auto projected = project(camera_, {T_camera_lidar}, R, edge);
      if (!projected) continue;
      points.push_back({&scene.fields.front(), R * edge.p_lidar, projected->normal, edge.strength});
    }
  }
  // A step turns by as much as the coarsest field is wide.
  const double step = scenes_.front().fields.front().sigma_px() / camera_.intrinsics().fx_px;
  const int steps = static_cast<int>(std::ceil(reach_rad / step));
  struct Candidate {
    double score;
    Vector3d turn;
  };
  std::vector<Candidate> candidates;
  for (int x = -steps; x <= steps && !stop.stop_requested(); ++x) {
    for (int y = -steps; y <= steps; ++y) {
      for (int z = -steps; z <= steps; ++z) {
        const Vector3d turn = step * Vector3d(x, y, z);
        if (turn.norm() > reach_rad + 0.5 * step) continue;
        const Eigen::Matrix3d R_turn = geometry::SO3::exp(turn).matrix();
        double score = 0.0;
        for (const Point& point : points) {
          const auto u_px = camera_.project(R_turn * point.p_camera + T_camera_lidar.translation());
          const float density = u_px ? point.field->density(*u_px, point.normal) : 0.0F;
          score += static_cast<double>(point.weight * gain_over_chance(density));
        }
        candidates.push_back({score, turn});
      }
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.score > b.score;
  });
  std::vector<Vector3d> chosen;
  std::vector<SE3> poses;
  for (const Candidate& candidate : candidates) {
    const bool near = std::any_of(chosen.begin(), chosen.end(), [&](const Vector3d& other) {
      return (other - candidate.turn).norm() < 1.5 * step;
    });
    if (near) continue;
    chosen.push_back(candidate.turn);
    poses.emplace_back(geometry::SO3::exp(candidate.turn) * T_camera_lidar.rotation(),
                       T_camera_lidar.translation());
    if (poses.size() == count) break;
  }
  return poses;
}

SE3 Alignment::climb(const SE3& T_camera_lidar,
                     std::size_t level,
                     const Prior& prior,
                     Part part) const {
  SE3 T = T_camera_lidar;
  const double sigma_px = scenes_.front().fields[level].sigma_px();
  for (int i = 0; i < kMaxSteps; ++i) {
    const NormalEquations equations = climb_equations(T, level, part);
    if (!(equations.inlier_weight > 0.0)) break;
    const Vector6d step = solve_step(equations, {T}, prior, sigma_px).head<6>();
    T = geometry::retract(T, step);
    if (step.head<3>().norm() * camera_.intrinsics().fx_px < 0.02 * sigma_px) break;
  }
  return T;
}

template <typename Visit>
void Alignment::for_each_match(
    const PreparedScene& scene, const Fit& fit, double reach_px, Part part, Visit&& visit) const {
  const Eigen::Matrix3d R = fit.T_camera_lidar.rotation().matrix();
  for (std::size_t i = 0; i < scene.lidar.edges.size(); ++i) {
    if (!selected(scene, i, part)) continue;
    const auto edge = project(camera_, fit, R, scene.lidar.edges[i]);
    if (edge) visit(i, *edge, match_contrast(scene.image, *edge, reach_px));
  }
}

NormalEquations Alignment::linearise(const Fit& fit, const Stage& stage, Part part) const {
  NormalEquations equations;
  for (const PreparedScene& scene : scenes_) {
    const auto add = [&](std::size_t i, const ProjectedEdge& edge, const Match& match) {
      const double weight = stage.weight(scene.lidar.edges[i]);
      const double w = weight * match.quality;
      equations.weight += weight;
      equations.H += w * edge.J.transpose() * edge.J;
      equations.b += w * match.offset_px * edge.J.transpose();
      equations.inlier_weight += w;
      equations.squared_error_px2 += w * match.offset_px * match.offset_px;
    };
    for_each_match(scene, fit, stage.reach_px, part, add);
  }
  return equations;
}

std::vector<Vector8d> Alignment::tile_gradients(const Fit& fit, const Stage& stage) const {
  std::vector<Vector8d> gradients;
  for (const PreparedScene& scene : scenes_) {
    const std::size_t first = gradients.size();
    gradients.resize(first + scene.tile_count, Vector8d::Zero());
    const auto add = [&](std::size_t i, const ProjectedEdge& edge, const Match& match) {
      const double w = stage.weight(scene.lidar.edges[i]) * match.quality;
      gradients[first + scene.tiles[i]] += w * match.offset_px * edge.J.transpose();
    };
    for_each_match(scene, fit, stage.reach_px, Part::kAll, add);
  }
  return gradients;
}

std::size_t Alignment::count(EdgeKind kind) const {
  std::size_t count = 0;
  for (const PreparedScene& scene : scenes_) {
    for (const LidarEdge& edge : scene.lidar.edges) count += edge.kind == kind ? 1 : 0;
  }
  return count;
}

std::vector<float> Alignment::densities(const PreparedScene& scene,
                                        const SE3& T_camera_lidar,
                                        std::size_t level) const {
  const Eigen::Matrix3d R = T_camera_lidar.rotation().matrix();
  std::vector<float> densities(scene.lidar.edges.size(), 0.0F);
  for (std::size_t i = 0; i < densities.size(); ++i) {
    const auto edge = project(camera_, {T_camera_lidar}, R, scene.lidar.edges[i]);
    if (edge) densities[i] = scene.fields[level].sample(edge->u_px, edge->normal).density;
  }
  return densities;
}

Gain Alignment::gain(const SE3& T_new, const SE3& T_old, std::size_t level, Part part) const {
  TileMean mean;
  for (const PreparedScene& scene : scenes_) {
    mean.start_scene(scene.tile_count);
    const auto of_new = densities(scene, T_new, level);
    const auto of_old = densities(scene, T_old, level);
    for (std::size_t i = 0; i < scene.lidar.edges.size(); ++i) {
      if (!selected(scene, i, part)) continue;
      mean.add(scene.tiles[i],
               static_cast<double>(scene.lidar.edges[i].strength),
               static_cast<double>(gain_over_chance(of_new[i]) - gain_over_chance(of_old[i])));
    }
  }
  return mean.result();
}

Gain Alignment::gain_over_nothing(const SE3& T_camera_lidar, std::size_t level) const {
  std::vector<std::vector<float>> densities_of;
  for (const PreparedScene& scene : scenes_) {
    densities_of.push_back(densities(scene, T_camera_lidar, level));
  }
  Gain best;
  for (double share = 0.3; share < 1.0; share += 0.05) {
    TileMean mean;
    for (std::size_t s = 0; s < scenes_.size(); ++s) {
      mean.start_scene(scenes_[s].tile_count);
      for (std::size_t i = 0; i < densities_of[s].size(); ++i) {
        mean.add(scenes_[s].tiles[i],
                 static_cast<double>(scenes_[s].lidar.edges[i].strength),
                 std::log(share + (1.0 - share) * static_cast<double>(densities_of[s][i])));
      }
    }
    const Gain gain = mean.result();
    if (gain.mean > best.mean) best = gain;
  }
  return best;
}

double Alignment::best_gain(std::size_t level) const {
  double sum = 0.0;
  double count = 0.0;
  for (const PreparedScene& scene : scenes_) {
    for (const Ridge& ridge : scene.image.ridges()) {
      const auto sample = scene.fields[level].sample({ridge.u, ridge.v}, ridge.normal);
      sum += static_cast<double>(gain_over_chance(sample.density));
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

Fit Alignment::refine(const Fit& start, const Stage& stage, const Prior& prior, Part part) const {
  Fit fit = start;
  for (int i = 0; i < 2 * kMaxSteps; ++i) {
    const NormalEquations equations = linearise(fit, stage, part);
    if (!(equations.inlier_weight > 0.0)) break;
    const Vector8d step = solve_step(equations, fit, prior, stage.reach_px);
    fit.T_camera_lidar = geometry::retract(fit.T_camera_lidar, step.head<6>());
    fit.widening_rad += step.tail<2>();
    if (step.head<3>().norm() < 1e-6 && step.segment<3>(3).norm() < 1e-5) break;
  }
  return fit;
}

Matrix8d prior_information(const Prior& prior) {
  Vector8d diagonal = Vector8d::Zero();
  diagonal.segment<3>(3).setConstant(1.0 / (prior.sigma_m * prior.sigma_m));
  diagonal.tail<2>().setConstant(1.0 / (prior.widening_sigma_rad * prior.widening_sigma_rad));
  return diagonal.asDiagonal();
}

Vector8d solve_step(const NormalEquations& equations,
                    const Fit& fit,
                    const Prior& prior,
                    double sigma_px) {
  const double scale = kIndependentShare / (sigma_px * sigma_px);
  const Matrix8d certainty = prior_information(prior);
  Matrix8d H = scale * equations.H + certainty;
  Vector8d b = scale * equations.b;
  const SE3& T = fit.T_camera_lidar;
  b.segment<3>(3) +=
      certainty(3, 3) * (T.rotation().inverse() * (prior.t_camera_lidar - T.translation()));
  b.tail<2>() -= certainty(6, 6) * fit.widening_rad;
  H.diagonal().head<6>().array() += 1e-9 * H.diagonal().head<6>().maxCoeff();
  return H.ldlt().solve(b);
}

}  // namespace camvox::calibration
