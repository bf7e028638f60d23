#include "camvox/calibration/lidar_edges.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "outlines.hpp"
#include "ridge.hpp"

namespace camvox::calibration {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kMinPoints = 500;

/// Directions around the axis of the view, equally spaced in azimuth and elevation.
class Panorama {
 public:
  Panorama(const LidarView& view, double cell_rad)
      : R_view_lidar_(view.R_view_lidar),
        cell_rad_(cell_rad),
        columns_(2 * static_cast<int>(std::ceil(view.half_width_rad / cell_rad)) + 1),
        rows_(2 * static_cast<int>(std::ceil(view.half_height_rad / cell_rad)) + 1) {}

  [[nodiscard]] Vector2d cell(const Vector3d& p_lidar) const {
    const Vector3d p = R_view_lidar_ * p_lidar;
    const double azimuth = std::atan2(p.x(), p.z());
    const double elevation = std::atan2(p.y(), std::hypot(p.x(), p.z()));
    return {azimuth / cell_rad_ + 0.5 * (columns_ - 1), elevation / cell_rad_ + 0.5 * (rows_ - 1)};
  }
  [[nodiscard]] Vector3d bearing_lidar(const Vector2d& cell) const {
    const double azimuth = (cell.x() - 0.5 * (columns_ - 1)) * cell_rad_;
    const double elevation = (cell.y() - 0.5 * (rows_ - 1)) * cell_rad_;
    return R_view_lidar_.transpose() * Vector3d(std::cos(elevation) * std::sin(azimuth),
                                                std::sin(elevation),
                                                std::cos(elevation) * std::cos(azimuth));
  }
  [[nodiscard]] int columns() const { return columns_; }
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] double cell_rad() const { return cell_rad_; }

 private:
  Eigen::Matrix3d R_view_lidar_;
  double cell_rad_;
  int columns_;
  int rows_;
};

/// A return in the view, in the order of the cloud: where, how far, and its rank in reflectivity.
struct Return {
  Vector2d cell;
  float inverse_range;  ///< 1 / m
  float rank;           ///< 0 to 1
};

/// Reflectivities become ranks: comparable between lidars, and robust to retroreflectors.
void rank_reflectivity(const std::vector<float>& reflectivity, std::vector<Return>& returns) {
  constexpr int kBins = 1024;
  const auto [low, high] = std::minmax_element(reflectivity.begin(), reflectivity.end());
  const float scale = *high > *low ? (kBins - 1) / (*high - *low) : 0.0F;
  std::vector<double> cumulative(kBins + 1, 0.0);
  const auto bin = [&](float value) { return static_cast<std::size_t>((value - *low) * scale); };
  for (const float value : reflectivity) cumulative[bin(value) + 1] += 1.0;
  std::partial_sum(cumulative.begin(), cumulative.end(), cumulative.begin());
  for (std::size_t i = 0; i < returns.size(); ++i) {
    const std::size_t b = bin(reflectivity[i]);
    returns[i].rank =
        static_cast<float>(0.5 * (cumulative[b] + cumulative[b + 1]) / cumulative.back());
  }
}

std::vector<Return> returns_in_view(const std::vector<Eigen::Vector4f>& points_lidar,
                                    const Panorama& panorama,
                                    const LidarEdgeConfig& config) {
  std::vector<Return> returns;
  std::vector<float> reflectivity;
  for (const Eigen::Vector4f& point : points_lidar) {
    if (!point.allFinite()) continue;
    const Vector3d p_lidar = point.head<3>().cast<double>();
    const double range_m = p_lidar.norm();
    if (range_m < config.min_range_m || range_m > config.max_range_m) continue;
    const Vector2d cell = panorama.cell(p_lidar);
    if (cell.x() < 0 || cell.y() < 0 || cell.x() > panorama.columns() - 1 ||
        cell.y() > panorama.rows() - 1) {
      continue;
    }
    returns.push_back({cell, static_cast<float>(1.0 / range_m), 0.0F});
    reflectivity.push_back(point.w());
  }
  if (!returns.empty()) {
    rank_reflectivity(reflectivity, returns);
  }
  return returns;
}

/// The mean distance of neighbouring returns in cells, from the part of the view that has any.
double mean_spacing(const std::vector<Return>& returns, const Panorama& panorama) {
  const int block = std::max(4, panorama.columns() / 80);
  cv::Mat count(panorama.rows() / block + 1, panorama.columns() / block + 1, CV_32S, cv::Scalar(0));
  for (const Return& r : returns) {
    ++count.at<int>(static_cast<int>(r.cell.y()) / block, static_cast<int>(r.cell.x()) / block);
  }
  const double area = static_cast<double>(cv::countNonZero(count)) * block * block;
  return std::sqrt(area / static_cast<double>(returns.size()));
}

/// What the returns tell of one quantity around each cell: a plane fitted to its neighbourhood.
struct LocalPlanes {
  cv::Mat value;           ///< 32F
  GradientImage gradient;  ///< Per cell; 0 where the returns lie on a line (one turn's scan line).
};

/// The lidar's view as smooth images.
struct Smooth {
  cv::Mat weight;           ///< Returns per cell, smoothed.
  LocalPlanes rank;         ///< Of reflectivity.
  LocalPlanes inverse;      ///< Of the inverse range: planes in space are planes in it.
  cv::Mat nearest_inverse;  ///< Of the nearest return around.
  cv::Mat mixed;            ///< 8U; where near and far returns alternate over more than an edge.
};

/// Sums over a Gaussian window of what is in the cells, times powers of the distance.
class WindowMoments {
 public:
  explicit WindowMoments(double sigma) {
    const int radius = static_cast<int>(std::ceil(3.0 * sigma));
    for (cv::Mat& kernel : kernels_) kernel.create(2 * radius + 1, 1, CV_32F);
    for (int i = -radius; i <= radius; ++i) {
      const double g = std::exp(-0.5 * i * i / (sigma * sigma));
      for (int power = 0; power < 3; ++power) {
        kernels_[static_cast<std::size_t>(power)].at<float>(i + radius) =
            static_cast<float>(g * std::pow(i, power));
      }
    }
  }
  [[nodiscard]] cv::Mat operator()(const cv::Mat& image, int power_x, int power_y) const {
    cv::Mat result;
    cv::sepFilter2D(image,
                    result,
                    CV_32F,
                    kernels_[static_cast<std::size_t>(power_x)],
                    kernels_[static_cast<std::size_t>(power_y)],
                    {-1, -1},
                    0,
                    cv::BORDER_CONSTANT);
    return result;
  }

 private:
  std::array<cv::Mat, 3> kernels_;
};

/// The part of the fits that does not depend on the quantity.
struct PositionMoments {
  cv::Mat w, x, y, xx, xy, yy;
};

/// First-order normalised convolution: cell by cell the weighted least-squares plane.
LocalPlanes fit_planes(const cv::Mat& weighted,
                       const PositionMoments& m,
                       const WindowMoments& window,
                       double sigma) {
  const cv::Mat f = window(weighted, 0, 0);
  const cv::Mat fx = window(weighted, 1, 0);
  const cv::Mat fy = window(weighted, 0, 1);
  const cv::Mat zero = cv::Mat::zeros(weighted.size(), CV_32F);
  LocalPlanes planes{zero.clone(), {zero.clone(), zero.clone(), {}}};
  const double min_spread = 0.2 * sigma * sigma;
  for (int row = 0; row < weighted.rows; ++row) {
    for (int column = 0; column < weighted.cols; ++column) {
      const auto at = [&](const cv::Mat& image) {
        return static_cast<double>(image.at<float>(row, column));
      };
      const double w = at(m.w);
      if (w < 1e-3) continue;
      const double mx = at(m.x) / w;
      const double my = at(m.y) / w;
      const double cxx = at(m.xx) / w - mx * mx;
      const double cxy = at(m.xy) / w - mx * my;
      const double cyy = at(m.yy) / w - my * my;
      const double mean = at(f) / w;
      const double cfx = at(fx) / w - mean * mx;
      const double cfy = at(fy) / w - mean * my;
      const double determinant = cxx * cyy - cxy * cxy;
      planes.value.at<float>(row, column) = static_cast<float>(mean);
      if (determinant < min_spread * std::max(cxx, cyy)) continue;
      const double slope_x = (cyy * cfx - cxy * cfy) / determinant;
      const double slope_y = (cxx * cfy - cxy * cfx) / determinant;
      planes.value.at<float>(row, column) = static_cast<float>(mean - slope_x * mx - slope_y * my);
      planes.gradient.x.at<float>(row, column) = static_cast<float>(slope_x);
      planes.gradient.y.at<float>(row, column) = static_cast<float>(slope_y);
    }
  }
  cv::magnitude(planes.gradient.x, planes.gradient.y, planes.gradient.magnitude);
  return planes;
}

constexpr float kNothing = 1e3F;  ///< Inverse range of cells without a return.

/// Where something moved while scans were accumulated, and in foliage, near and far returns lie
/// side by side all over; at an edge they do so on a strip only.
cv::Mat mixed_regions(const cv::Mat& nearest, const cv::Mat& farthest, double sigma) {
  constexpr double kMaxStep = 0.2;  // of the inverse range
  cv::Mat near_around;
  cv::Mat far_around;
  cv::dilate(nearest, near_around, cv::Mat::ones(3, 3, CV_8U));
  cv::erode(farthest, far_around, cv::Mat::ones(3, 3, CV_8U));
  cv::Mat mixed = far_around < (1.0 - kMaxStep) * near_around;
  const int strip = 2 * static_cast<int>(std::ceil(5.0 * sigma)) + 1;
  const cv::Mat window = cv::Mat::ones(strip, strip, CV_8U);
  // Closed first: a cell or two without a return of one kind do not part a region.
  cv::morphologyEx(mixed, mixed, cv::MORPH_CLOSE, cv::Mat::ones(3, 3, CV_8U));
  cv::morphologyEx(mixed, mixed, cv::MORPH_OPEN, window);
  cv::dilate(mixed, mixed, window);
  return mixed;
}

Smooth smooth_images(const std::vector<Return>& returns,
                     const Panorama& panorama,
                     double sigma,
                     const std::stop_token& stop) {
  const cv::Size size(panorama.columns(), panorama.rows());
  const cv::Mat zero = cv::Mat::zeros(size, CV_32F);
  cv::Mat count = zero.clone();
  cv::Mat rank = zero.clone();
  cv::Mat inverse = zero.clone();
  Smooth smooth;
  smooth.nearest_inverse = zero.clone();
  cv::Mat farthest(size, CV_32F, cv::Scalar(kNothing));
  for (const Return& r : returns) {
    // Spread over four cells: the place within a cell is not lost.
    const int u = std::min(static_cast<int>(r.cell.x()), size.width - 2);
    const int v = std::min(static_cast<int>(r.cell.y()), size.height - 2);
    const auto a = static_cast<float>(r.cell.x() - u);
    const auto b = static_cast<float>(r.cell.y() - v);
    const std::array<float, 4> share = {(1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b};
    for (int k = 0; k < 4; ++k) {
      const int row = v + k / 2;
      const int column = u + k % 2;
      const float w = share[static_cast<std::size_t>(k)];
      count.at<float>(row, column) += w;
      rank.at<float>(row, column) += w * r.rank;
      inverse.at<float>(row, column) += w * r.inverse_range;
    }
    float& nearest = smooth.nearest_inverse.at<float>(v + (b > 0.5F), u + (a > 0.5F));
    nearest = std::max(nearest, r.inverse_range);
    float& far = farthest.at<float>(v + (b > 0.5F), u + (a > 0.5F));
    far = std::min(far, r.inverse_range);
  }
  const WindowMoments window(sigma);
  const PositionMoments moments{window(count, 0, 0),
                                window(count, 1, 0),
                                window(count, 0, 1),
                                window(count, 2, 0),
                                window(count, 1, 1),
                                window(count, 0, 2)};
  smooth.weight = moments.w;
  if (stop.stop_requested()) return smooth;
  smooth.rank = fit_planes(rank, moments, window, sigma);
  if (stop.stop_requested()) return smooth;
  smooth.inverse = fit_planes(inverse, moments, window, sigma);
  smooth.mixed = mixed_regions(smooth.nearest_inverse, farthest, sigma);
  const int reach = 2 * static_cast<int>(std::ceil(1.5 * sigma)) + 1;
  cv::dilate(smooth.nearest_inverse, smooth.nearest_inverse, cv::Mat::ones(reach, reach, CV_8U));
  return smooth;
}

/// A ridge with what is needed to make an edge of it.
struct Candidate {
  Ridge ridge;
  EdgeKind kind;
};

/// Drops what lies where the lidar hardly looked: at the rim of its view, beside the sky.
bool well_sampled(const Smooth& smooth, const Ridge& ridge, double reach, float min_weight) {
  for (const double side : {-reach, 0.0, reach}) {
    const int u = static_cast<int>(std::lround(ridge.u + side * ridge.normal.x()));
    const int v = static_cast<int>(std::lround(ridge.v + side * ridge.normal.y()));
    if (u < 0 || v < 0 || u >= smooth.weight.cols || v >= smooth.weight.rows) return false;
    if (smooth.weight.at<float>(v, u) < min_weight) return false;
  }
  return true;
}

/// Whether the gradient stands out from that on both sides: an edge, not a slope.
bool is_crest(const GradientImage& image, const Ridge& ridge, double reach) {
  for (const double side : {-reach, reach}) {
    const int u = static_cast<int>(std::lround(ridge.u + side * ridge.normal.x()));
    const int v = static_cast<int>(std::lround(ridge.v + side * ridge.normal.y()));
    if (u < 0 || v < 0 || u >= image.x.cols || v >= image.x.rows) return false;
    const double slope = ridge.normal.x() * static_cast<double>(image.x.at<float>(v, u)) +
                         ridge.normal.y() * static_cast<double>(image.y.at<float>(v, u));
    if (slope > 0.6 * static_cast<double>(ridge.strength)) return false;
  }
  return true;
}

void collect(const Smooth& smooth,
             double sigma,
             bool in_lines,
             const LidarEdgeConfig& config,
             std::vector<Candidate>& candidates) {
  const double spread = std::sqrt(2.0 * std::numbers::pi) * sigma;  // step = peak gradient * spread
  const double mean_weight = cv::mean(smooth.weight, smooth.weight > 1e-3F)[0];
  const auto min_weight = static_cast<float>(0.15 * mean_weight);
  // Relative to the value itself, a step of depth is the same near and far.
  GradientImage depth = smooth.inverse.gradient;
  // (The nearest value, not the mean: one that changes across the edge would shift it.)
  const cv::Mat scale = 1.0 / cv::max(smooth.nearest_inverse, 1e-3F);
  depth.x = depth.x.mul(scale);
  depth.y = depth.y.mul(scale);
  depth.magnitude = depth.magnitude.mul(scale);
  const auto strong_depth = static_cast<float>((1.0 - 1.0 / config.min_depth_ratio) / spread);
  cv::Mat depth_edge(depth.magnitude.size(), CV_8U, cv::Scalar(0));
  const auto is_mixed = [&](const Ridge& ridge) {
    return !in_lines && smooth.mixed.at<std::uint8_t>(static_cast<int>(std::lround(ridge.v)),
                                                      static_cast<int>(std::lround(ridge.u))) != 0;
  };
  for (const Ridge& ridge : find_ridges(depth, strong_depth, config.min_length)) {
    if (is_mixed(ridge)) continue;
    if (!is_crest(depth, ridge, 2.0 * sigma)) continue;
    depth_edge.at<std::uint8_t>(static_cast<int>(std::lround(ridge.v)),
                                static_cast<int>(std::lround(ridge.u))) = 255;
    if (well_sampled(smooth, ridge, 2.0 * sigma, min_weight)) {
      candidates.push_back({ridge, EdgeKind::kDepth});
    }
  }
  const int reach = 2 * static_cast<int>(std::ceil(2.0 * sigma)) + 1;
  cv::dilate(depth_edge, depth_edge, cv::Mat::ones(reach, reach, CV_8U));
  const auto strong_rank = static_cast<float>(config.min_reflectivity_step / spread);
  for (const Ridge& ridge : find_ridges(smooth.rank.gradient, strong_rank, config.min_length)) {
    if (depth_edge.at<std::uint8_t>(static_cast<int>(std::lround(ridge.v)),
                                    static_cast<int>(std::lround(ridge.u))) != 0) {
      continue;
    }
    if (is_mixed(ridge)) continue;
    // The lasers of a spinning lidar differ, so each line has a brightness of its own.
    if (in_lines && std::abs(ridge.normal.y()) > 0.7) continue;
    if (is_crest(smooth.rank.gradient, ridge, 2.0 * sigma) &&
        well_sampled(smooth, ridge, 2.0 * sigma, min_weight)) {
      candidates.push_back({ridge, EdgeKind::kReflectivity});
    }
  }
}

/// Keeps the strongest in every tile of the view, so that no part of it rules.
std::vector<Candidate> spread_evenly(std::vector<Candidate> candidates,
                                     const Panorama& panorama,
                                     int max_edges) {
  constexpr int kTilesAcross = 24;
  if (candidates.size() <= static_cast<std::size_t>(max_edges)) return candidates;
  std::stable_sort(candidates.begin(), candidates.end(), [](const auto& a, const auto& b) {
    return a.ridge.strength > b.ridge.strength;
  });
  const double tile = panorama.columns() / static_cast<double>(kTilesAcross);
  const auto tile_of = [&](const Candidate& candidate) {
    return static_cast<std::size_t>(candidate.ridge.v / tile) * (kTilesAcross + 1) +
           static_cast<std::size_t>(candidate.ridge.u / tile);
  };
  std::vector<int> sizes((static_cast<std::size_t>(panorama.rows() / tile) + 2) *
                         (kTilesAcross + 1));
  for (const Candidate& candidate : candidates) ++sizes[tile_of(candidate)];
  std::vector<int> sorted = sizes;
  std::sort(sorted.begin(), sorted.end());
  // The largest size of a tile with which all tiles together stay within the limit.
  int limit = 0;
  for (int total = 0; total <= max_edges;) {
    ++limit;
    total = 0;
    for (const int size : sorted) total += std::min(size, limit);
  }
  std::vector<int> used(sizes.size(), 0);
  std::erase_if(candidates, [&](const Candidate& c) { return ++used[tile_of(c)] >= limit; });
  return candidates;
}

/// Turns strengths into ranks within the kind.
void rank_strengths(std::vector<LidarEdge>& edges) {
  for (const EdgeKind kind : {EdgeKind::kReflectivity, EdgeKind::kDepth}) {
    std::vector<LidarEdge*> of_kind;
    for (LidarEdge& edge : edges) {
      if (edge.kind == kind) of_kind.push_back(&edge);
    }
    std::stable_sort(of_kind.begin(), of_kind.end(), [](const auto* a, const auto* b) {
      return a->strength < b->strength;
    });
    for (std::size_t i = 0; i < of_kind.size(); ++i) {
      of_kind[i]->strength = static_cast<float>(i + 1) / static_cast<float>(of_kind.size());
    }
  }
}

LidarEdge make_edge(const Candidate& candidate, const Smooth& smooth, const Panorama& panorama) {
  const Ridge& ridge = candidate.ridge;
  const Vector2d place(ridge.u, ridge.v);
  const int u = static_cast<int>(std::lround(ridge.u));
  const int v = static_cast<int>(std::lround(ridge.v));
  const cv::Mat& inverse =
      candidate.kind == EdgeKind::kDepth ? smooth.nearest_inverse : smooth.inverse.value;
  const Vector2d along(-ridge.normal.y(), ridge.normal.x());
  const Vector3d f_lidar = panorama.bearing_lidar(place);
  LidarEdge edge;
  edge.p_lidar = f_lidar / static_cast<double>(std::max(inverse.at<float>(v, u), 1e-3F));
  edge.tangent_lidar =
      (panorama.bearing_lidar(place + along) - panorama.bearing_lidar(place - along)).normalized();
  edge.strength = ridge.strength;
  edge.kind = candidate.kind;
  if (candidate.kind == EdgeKind::kReflectivity) return edge;
  for (int axis = 0; axis < 2; ++axis) {
    const Vector2d unit = Vector2d::Unit(axis);
    const Vector3d e_lidar =
        (panorama.bearing_lidar(place + unit) - panorama.bearing_lidar(place - unit)).normalized();
    // The gradient of the inverse range points to what is near.
    edge.widening_lidar.col(axis) = -ridge.normal[axis] * edge.p_lidar.norm() * e_lidar;
  }
  return edge;
}

std::vector<Vector3d> in_space(const std::vector<Return>& returns, const Panorama& panorama) {
  std::vector<Vector3d> points_lidar;
  points_lidar.reserve(returns.size());
  for (const Return& r : returns) {
    points_lidar.push_back(panorama.bearing_lidar(r.cell) / static_cast<double>(r.inverse_range));
  }
  return points_lidar;
}

}  // namespace

LidarEdges extract_lidar_edges(const std::vector<Eigen::Vector4f>& points_lidar,
                               const LidarView& view,
                               const LidarEdgeConfig& config,
                               const std::stop_token& stop) {
  LidarEdges result;
  const Panorama finest(view, view.min_cell_rad);
  std::vector<Return> returns = returns_in_view(points_lidar, finest, config);
  result.points_in_view = returns.size();
  if (returns.size() < kMinPoints) return result;
  const double spacing_rad = mean_spacing(returns, finest) * view.min_cell_rad;
  const Panorama panorama(view, std::max(view.min_cell_rad, 0.7 * spacing_rad));
  const double ratio = finest.cell_rad() / panorama.cell_rad();
  const Vector2d old_centre(0.5 * (finest.columns() - 1), 0.5 * (finest.rows() - 1));
  const Vector2d new_centre(0.5 * (panorama.columns() - 1), 0.5 * (panorama.rows() - 1));
  for (Return& r : returns) r.cell = (r.cell - old_centre) * ratio + new_centre;
  const double sigma = std::max(1.0, config.smoothing * spacing_rad / panorama.cell_rad());
  if (stop.stop_requested()) return {};
  const Smooth smooth = smooth_images(returns, panorama, sigma, stop);
  if (stop.stop_requested()) return {};
  std::vector<Candidate> candidates;
  const bool in_lines = spacing_rad > 2.0 * view.min_cell_rad;
  collect(smooth, sigma, in_lines, config, candidates);
  for (const Candidate& candidate :
       spread_evenly(std::move(candidates), panorama, config.max_edges)) {
    result.edges.push_back(make_edge(candidate, smooth, panorama));
  }
  rank_strengths(result.edges);
  if (in_lines) {
    const auto outlines = find_outlines(in_space(returns, panorama), config.min_depth_ratio);
    result.edges.insert(result.edges.end(), outlines.begin(), outlines.end());
  }
  result.sigma_rad = sigma * panorama.cell_rad();
  return result;
}

}  // namespace camvox::calibration
