#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "camvox/features/hamming.hpp"
#include "camvox/features/match.hpp"
#include "camvox/mapping/landmarks.hpp"

namespace camvox::mapping {
namespace {

constexpr double kEpipolarGate = 3.84;       // chi-square, one degree of freedom, 95 %
constexpr double kReprojectionGate = 5.991;  // two degrees
constexpr double kScaleTolerance = 1.5;

/// A feature that shows no landmark yet.
struct FreeFeature {
  std::uint32_t feature = 0;
  Eigen::Vector2d u_px;
  double sigma_px = 0.0;
};

std::vector<FreeFeature> free_features(const MapKeyframe& keyframe, const ObservationModel& model) {
  std::vector<FreeFeature> list;
  const auto& frame = keyframe.frame;
  for (std::uint32_t i = 0; i < frame.features.size(); ++i) {
    if (frame.landmark_ids[i] != 0) continue;
    list.push_back({i,
                    frame.features.undistorted_px[i].cast<double>(),
                    model.sigma_px(frame.features.key_points[i].octave)});
  }
  return list;
}

/// The matrix F with u_b^T F u_a = 0 for pixels of one point in both cameras.
Eigen::Matrix3d fundamental_matrix(const geometry::SE3& T_b_a, const ObservationModel& model) {
  const auto& pinhole = model.camera().pinhole;
  Eigen::Matrix3d K;
  K << pinhole.fx_px, 0.0, pinhole.cx_px, 0.0, pinhole.fy_px, pinhole.cy_px, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d K_inverse = K.inverse();
  return K_inverse.transpose() * geometry::skew(T_b_a.translation()) * T_b_a.rotation().matrix() *
         K_inverse;
}

/// Free features of `a` and `b` that lie on each other's epipolar lines and look alike.
std::vector<features::Match> match_along_epipolars(const MapKeyframe& a,
                                                   const MapKeyframe& b,
                                                   const ObservationModel& model) {
  const auto free_a = free_features(a, model);
  const auto free_b = free_features(b, model);
  const Eigen::Matrix3d F =
      fundamental_matrix(b.frame.T_map_camera.inverse() * a.frame.T_map_camera, model);
  std::vector<features::Match> best_of_b(b.frame.features.size(),
                                         {0, 0, features::kDescriptorBits});
  for (const auto& from : free_a) {
    const Eigen::Vector3d line = F * from.u_px.homogeneous();
    const double norm2 = line.head<2>().squaredNorm();
    int best = features::kStrictDistance + 1;
    std::uint32_t best_feature = 0;
    for (const auto& to : free_b) {
      const double offset = line.x() * to.u_px.x() + line.y() * to.u_px.y() + line.z();
      if (!(offset * offset < kEpipolarGate * to.sigma_px * to.sigma_px * norm2)) continue;
      const int distance = features::hamming_distance(a.frame.features.descriptors[from.feature],
                                                      b.frame.features.descriptors[to.feature]);
      if (distance >= best) continue;
      best = distance;
      best_feature = to.feature;
    }
    if (best > features::kStrictDistance || best >= best_of_b[best_feature].distance) continue;
    best_of_b[best_feature] = {from.feature, best_feature, best};
  }
  std::erase_if(best_of_b,
                [](const auto& match) { return match.distance > features::kStrictDistance; });
  std::sort(best_of_b.begin(), best_of_b.end(), [](const auto& x, const auto& y) {
    return x.query < y.query;
  });
  std::vector<float> angles_rad;
  for (const auto& point : a.frame.features.key_points) angles_rad.push_back(point.angle_rad);
  features::keep_consistent_rotations(angles_rad, b.frame.features.key_points, best_of_b);
  return best_of_b;
}

/// A feature in a keyframe with everything that triangulation asks of it.
struct View {
  const tracking::Keyframe& frame;
  std::uint32_t feature;
  optimization::PointObservation observation;
  Eigen::Vector3d ray_map;  ///< Of depth 1.

  View(const MapKeyframe& keyframe, std::uint32_t index, const ObservationModel& model)
      : frame(keyframe.frame),
        feature(index),
        observation(model.observation(frame.features, index)),
        ray_map(frame.T_map_camera.rotation() * model.bearing(observation.u_px)) {}

  [[nodiscard]] const Eigen::Vector3d& centre() const { return frame.T_map_camera.translation(); }
};

/// Depths along both rays where they pass each other.
std::optional<Eigen::Vector2d> intersect(const View& a, const View& b) {
  const Eigen::Vector3d baseline = b.centre() - a.centre();
  Eigen::Matrix2d A;
  A << a.ray_map.squaredNorm(), -a.ray_map.dot(b.ray_map), a.ray_map.dot(b.ray_map),
      -b.ray_map.squaredNorm();
  const Eigen::Vector2d rhs(a.ray_map.dot(baseline), b.ray_map.dot(baseline));
  const double determinant = A.determinant();
  if (std::abs(determinant) < 1e-12) return std::nullopt;
  const Eigen::Vector2d depths = A.inverse() * rhs;
  if (!(depths.minCoeff() > 0.05)) return std::nullopt;
  return depths;
}

/// The most certain point of the three: lidar depth of a, of b, or where the rays meet.
std::optional<Eigen::Vector3d> locate(const View& a, const View& b, const ObservationModel& model) {
  const double sine = a.ray_map.normalized().cross(b.ray_map.normalized()).norm();
  const double min_sine = std::sin(model.config().min_parallax_deg * std::numbers::pi / 180.0);
  std::optional<Eigen::Vector3d> best;
  double best_sigma_m = 1e9;
  const auto depths = sine >= min_sine ? intersect(a, b) : std::nullopt;
  if (depths) {
    const Eigen::Vector3d on_a = a.centre() + depths->x() * a.ray_map;
    const Eigen::Vector3d on_b = b.centre() + depths->y() * b.ray_map;
    best = 0.5 * (on_a + on_b);
    best_sigma_m = depths->x() * std::hypot(a.observation.sigma_px, b.observation.sigma_px) /
                   (model.camera().pinhole.fx_px * sine);
  }
  for (const View* view : {&a, &b}) {
    if (view->observation.depth_m <= 0.0) continue;
    const double sigma_m = model.depth_sigma_m(view->observation);
    if (sigma_m >= best_sigma_m) continue;
    best = view->centre() + view->observation.depth_m * view->ray_map;
    best_sigma_m = sigma_m;
  }
  return best;
}

bool reprojects(const Eigen::Vector3d& p_map, const View& view, const ObservationModel& model) {
  const auto sight = model.project(view.frame.T_map_camera, p_map);
  if (!sight) return false;
  const double sigma_px = view.observation.sigma_px;
  return (sight->u_px - view.observation.u_px).squaredNorm() <
         kReprojectionGate * sigma_px * sigma_px;
}

/// Whether both octaves show a patch of the same size.
bool same_scale(const Eigen::Vector3d& p_map,
                const View& a,
                const View& b,
                const ObservationModel& model) {
  const double size_a =
      (p_map - a.centre()).norm() * model.scale(a.frame.features.key_points[a.feature].octave);
  const double size_b =
      (p_map - b.centre()).norm() * model.scale(b.frame.features.key_points[b.feature].octave);
  const double tolerance = kScaleTolerance * model.camera().scale.factor;
  return size_a < tolerance * size_b && size_b < tolerance * size_a;
}

bool make_landmark(
    Map& map, const ObservationModel& model, const View& a, const View& b, KeyframeId newest) {
  const auto p_map = locate(a, b, model);
  if (!p_map || !reprojects(*p_map, a, model) || !reprojects(*p_map, b, model) ||
      !same_scale(*p_map, a, b, model)) {
    return false;
  }
  tracking::Landmark landmark;
  landmark.id = tracking::landmark_id(a.frame.id, a.feature);
  if (map.find_landmark(landmark.id) != nullptr) return false;
  landmark.p_map = *p_map;
  map.add_landmark(landmark, {a.frame.id, a.feature}, newest);
  map.observe(landmark.id, {b.frame.id, b.feature});
  refresh_landmark(map, model, landmark.id);
  return true;
}

}  // namespace

std::size_t triangulate_landmarks(Map& map, const ObservationModel& model, KeyframeId id) {
  std::size_t made = 0;
  const auto limit = static_cast<std::size_t>(model.config().triangulation_neighbours);
  for (const auto neighbour : map.neighbours(id, limit)) {
    const MapKeyframe& a = map.keyframe(id);
    const MapKeyframe& b = map.keyframe(neighbour);
    for (const auto& match : match_along_epipolars(a, b, model)) {
      const View view_a(a, match.query, model);
      const View view_b(b, match.target, model);
      if (make_landmark(map, model, view_a, view_b, id)) ++made;
    }
  }
  return made;
}

}  // namespace camvox::mapping
