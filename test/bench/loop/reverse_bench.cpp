#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <random>

#include "camvox/component/progress.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "camvox/loop/surface_registration.hpp"
#include "camvox/loop/surroundings.hpp"
#include "drive.hpp"
#include "reverse/points.hpp"
#include "reverse/ring_descriptor.hpp"
#include "reverse/there_and_back.hpp"

/// Places seen again in the other direction: what the images say, and what the surfaces say that
/// were measured along 25 m of path before and after a place, from the depth of keyframes' features
/// or from all lidar returns. Prints Markdown.
///   reverse_bench street|plaza|corridor|loop_400m|campus_1800m CACHE_FOLDER
///   [features|lidar|images]
namespace camvox::bench {
namespace {

using geometry::SE3;
using loop::Registration;
using loop::RegistrationStart;
using loop::RegistrationStatus;
using loop::SurfaceMap;
using loop::SurfaceView;
using loop::SurroundingsConfig;

constexpr double kRate_hz = 2.0;   ///< Of the keyframes.
constexpr double kPlaces_m = 3.0;  ///< Distance between places along the path.
constexpr double kBeside_m = 4.0;  ///< Nearer, it is the same place.
constexpr double kMapError_m =
    4.0;  ///< How far the map is off when a place is seen again, per axis.
constexpr double kMapError_rad = 0.07;
constexpr double kDegPerRad = 57.29578;

/// Odometry that drifts as a tracker's.
std::vector<SE3> drifted(const std::vector<SE3>& truth, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> unit;
  std::vector<SE3> poses = {truth.front()};
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const SE3 T = truth[i - 1].inverse() * truth[i];
    geometry::Vector6d noise;
    for (int k = 0; k < 6; ++k) {
      noise[k] = unit(random) * (k < 3 ? 2e-4 : 3e-3) * std::sqrt(T.translation().norm());
    }
    poses.push_back(poses.back() * SE3(T.rotation(), 1.003 * T.translation()) * SE3::exp(noise));
  }
  return poses;
}

struct Place {
  std::size_t frame = 0;
  double path_m = 0.0;
  SE3 T_camera_level;
  RingDescriptor ring;
  SurfaceMap surfaces{std::vector<Eigen::Vector3f>()};
};

/// How two places lie to each other in truth.
struct Relation {
  SE3 T_match_query;
  double distance_m = 0.0;
  double turn_rad = 0.0;
  [[nodiscard]] bool reverse() const { return turn_rad > 2.35; }
};

class Path {
 public:
  explicit Path(std::vector<SE3> truth) : truth_(std::move(truth)), odometry_(drifted(truth_, 1)) {
    path_m_ = {0.0};
    for (std::size_t i = 1; i < truth_.size(); ++i) {
      path_m_.push_back(path_m_.back() +
                        (truth_[i].translation() - truth_[i - 1].translation()).norm());
    }
  }

  [[nodiscard]] Relation relation(std::size_t match, std::size_t query) const {
    const SE3 T = truth_[match].inverse() * truth_[query];
    return {T, T.translation().norm(), T.rotation().angle_rad()};
  }

  [[nodiscard]] std::vector<std::size_t> place_frames() const {
    std::vector<std::size_t> frames;
    for (std::size_t i = 0; i < truth_.size(); ++i) {
      if (frames.empty() || path_m_[i] >= path_m_[frames.back()] + kPlaces_m) frames.push_back(i);
    }
    return frames;
  }

  [[nodiscard]] Place place(std::size_t frame,
                            const Points& points,
                            const SurroundingsConfig& config) const {
    std::vector<SurfaceView> views;
    std::size_t centre = 0;
    for (std::size_t k = 0; k < truth_.size(); ++k) {
      if (std::abs(path_m_[k] - path_m_[frame]) > config.reach_m) continue;
      if (k == frame) centre = views.size();
      views.push_back({points[k], odometry_[frame].inverse() * odometry_[k]});
    }
    const auto around = loop::gather(views, centre, config);
    return {frame,
            path_m_[frame],
            around.T_place_level,
            RingDescriptor(around.points_level, config.max_range_m),
            SurfaceMap(around.points_level)};
  }

  [[nodiscard]] double between_m(std::size_t a, std::size_t b) const {
    return std::abs(path_m_[b] - path_m_[a]);
  }

 private:
  std::vector<SE3> truth_;
  std::vector<SE3> odometry_;
  std::vector<double> path_m_;
};

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// One registration and how it compares with the truth.
struct Trial {
  Registration result;
  double error_m = 0.0;
  double error_deg = 0.0;
  [[nodiscard]] bool right() const { return error_m < 0.3 && error_deg < 2.0; }
  /// As the other benchmarks call a loop false.
  [[nodiscard]] bool wrong() const { return error_m > 0.5 || error_deg > 2.9; }
};

class Experiment {
 public:
  Experiment(const Path& path, const Points& points) : path_(path) {
    for (const auto frame : path.place_frames()) {
      const double before_s = thread_processor_time_s();
      places_.push_back(path.place(frame, points, surroundings_));
      gather_ms_.push_back(1e3 * (thread_processor_time_s() - before_s));
    }
  }

  void run() {
    for (std::size_t q = 0; q < places_.size(); ++q) {
      std::vector<std::size_t> older;
      for (std::size_t m = 0; m < q; ++m) {
        if (path_.between_m(places_[m].frame, places_[q].frame) > 2.0 * surroundings_.reach_m) {
          older.push_back(m);
        }
      }
      if (!older.empty()) look(q, older);
    }
  }

  void print(const char* world, const char* kind) const {
    double limit = 0.0;  // that lets no wrong pose pass
    int accepted_wrong = 0;
    for (const auto* list : {&elsewhere_, &again_}) {
      for (const auto& trial : *list) {
        if (list == &again_ && !trial.wrong()) continue;
        limit = std::max(limit, trial.result.distinction);
        accepted_wrong += trial.result.status == RegistrationStatus::kOk ? 1 : 0;
      }
    }
    std::vector<double> error_m, error_deg;
    int right = 0, above = 0;
    for (const auto& trial : again_) {
      right += trial.right() ? 1 : 0;
      above += !trial.wrong() && trial.result.distinction > limit ? 1 : 0;
      if (trial.result.status != RegistrationStatus::kOk) continue;
      error_m.push_back(trial.error_m);
      error_deg.push_back(trial.error_deg);
    }
    std::printf("| %s | %s | %zu | %d | %d | %d, %.2f | %zu, %d of %zu | ",
                world,
                kind,
                again_.size(),
                ranked_,
                right,
                above,
                limit,
                error_m.size(),
                accepted_wrong,
                elsewhere_.size());
    if (!error_m.empty()) {
      std::printf("%.2f / %.2f m, %.2f / %.2f deg",
                  quantile(error_m, 0.5),
                  quantile(error_m, 1.0),
                  quantile(error_deg, 0.5),
                  quantile(error_deg, 1.0));
    }
    std::printf(" | %.0f + %.0f ms |\n", quantile(gather_ms_, 0.5), quantile(register_ms_, 0.5));
  }

 private:
  /// The place itself, where it was passed in the other direction; and a place that is another.
  void look(std::size_t q, const std::vector<std::size_t>& older) {
    std::vector<std::size_t> others;
    std::size_t nearest = q;
    double nearest_m = kBeside_m;
    for (const auto m : older) {
      const auto relation = path_.relation(places_[m].frame, places_[q].frame);
      if (!relation.reverse()) continue;
      if (relation.distance_m > 15.0) others.push_back(m);
      if (relation.distance_m >= nearest_m) continue;
      nearest_m = relation.distance_m;
      nearest = m;
    }
    if (nearest != q) {
      again_.push_back(attempt(nearest, q));
      ranked_ += ranked(q, older) ? 1 : 0;
    }
    if (!others.empty()) elsewhere_.push_back(attempt(others[random_() % others.size()], q));
  }

  double off(double range) {
    return range * (static_cast<double>(random_() % 20001) / 10000.0 - 1.0);
  }

  /// From where a map would place the query that is off by some metres; a place that is another
  /// one could just as well lie there.
  Trial attempt(std::size_t match, std::size_t query) {
    const auto& a = places_[match];
    const auto& b = places_[query];
    const auto relation = path_.relation(a.frame, b.frame);
    const SE3 T = a.T_camera_level.inverse() * relation.T_match_query * b.T_camera_level;
    const bool same = relation.distance_m < kBeside_m;
    const Eigen::Matrix3d R = T.rotation().matrix();
    RegistrationStart start;
    start.T_target_source =
        SE3(geometry::SO3::exp({0, 0, std::atan2(R(1, 0), R(0, 0)) + off(kMapError_rad)}),
            Eigen::Vector3d((same ? T.translation().x() : 0.0) + off(kMapError_m),
                            (same ? T.translation().y() : 0.0) + off(kMapError_m),
                            0.0));
    start.search_m = 1.5 * kMapError_m;
    start.search_yaw_rad = 2.0 * kMapError_rad;
    const double before_s = thread_processor_time_s();
    const auto result = register_surfaces(b.surfaces, a.surfaces, start, {});
    register_ms_.push_back(1e3 * (thread_processor_time_s() - before_s));
    const auto error = geometry::local(T, result.T_target_source);
    return {result, error.tail<3>().norm(), kDegPerRad * error.head<3>().norm()};
  }

  /// Whether the descriptor, without any help of the map, names the place among its best three.
  [[nodiscard]] bool ranked(std::size_t q, const std::vector<std::size_t>& older) const {
    constexpr double kMinTurn_rad = 1.5;
    constexpr std::size_t kBest = 3;
    std::vector<std::pair<double, std::size_t>> order;
    for (const auto m : older) {
      order.emplace_back(places_[m].ring.distance(places_[q].ring, kMinTurn_rad).value, m);
    }
    std::sort(order.begin(), order.end());
    std::vector<std::size_t> best;
    for (const auto& [distance, m] : order) {
      const auto beside = [&, m = m](std::size_t other) {
        return path_.between_m(places_[other].frame, places_[m].frame) < 8.0;
      };
      if (best.size() < kBest && std::none_of(best.begin(), best.end(), beside)) best.push_back(m);
    }
    return std::any_of(best.begin(), best.end(), [&](std::size_t m) {
      return path_.relation(places_[m].frame, places_[q].frame).distance_m < kBeside_m + 1.0;
    });
  }

  const Path& path_;
  SurroundingsConfig surroundings_;
  std::vector<Place> places_;
  std::mt19937 random_{7};
  std::vector<Trial> again_;
  std::vector<Trial> elsewhere_;
  std::vector<double> gather_ms_;
  std::vector<double> register_ms_;
  int ranked_ = 0;
};

void print_header() {
  std::puts(
      "| world | points | reverse revisits | descriptor: among the best 3 | right pose found | "
      "above every wrong one, which is | accepted, wrong ones of other places | error, median / "
      "max "
      "| gather + register |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
}

/// What verification of images confirms, of places seen again in the same and in the other
/// direction.
void report_images(const char* world, const Drive& drive, const Path& path) {
  loop::LoopCloser closer{loop::LoopCloserConfig()};
  const auto places = path.place_frames();
  std::array<int, 2> again{}, confirmed{};
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    auto keyframe = drive.frames[i];
    keyframe.id = i + 1;
    keyframe.parent_id = i;
    closer.insert(keyframe);
    if (!std::binary_search(places.begin(), places.end(), i)) continue;
    std::array<bool, 2> seen{}, found{};
    for (std::size_t m = 0; m < i; ++m) {
      const auto relation = path.relation(m, i);
      if (path.between_m(m, i) < 50.0 || relation.distance_m > kBeside_m) continue;
      if (relation.reverse()) seen[1] = true;
      if (relation.turn_rad < 0.8) seen[0] = true;
    }
    if (!seen[0] && !seen[1]) continue;
    for (const auto& place :
         loop::verify(closer.detect(keyframe.id), drive.camera, closer.config())) {
      if (place.verification.status != loop::VerificationStatus::kOk) continue;
      found[path.relation(place.match_id - 1, i).turn_rad > 1.57 ? 1 : 0] = true;
    }
    for (std::size_t way = 0; way < 2; ++way) {
      again[way] += seen[way] ? 1 : 0;
      confirmed[way] += seen[way] && found[way] ? 1 : 0;
    }
  }
  std::printf(
      "\n%s, by images: %d of %d places confirmed in the same direction, %d of %d in reverse\n",
      world,
      confirmed[0],
      again[0],
      confirmed[1],
      again[1]);
}

void report(const std::string& world, const std::filesystem::path& cache, const std::string& what) {
  const auto spec = ThereAndBack::make(world);
  const auto drive =
      Drive::make(spec.options, kRate_hz, cache / (world + ".keyframes"), spec.trajectory);
  std::vector<SE3> truth;
  for (const auto& frame : drive.frames) truth.push_back(frame.T_map_camera);
  const Path path(truth);
  if (what != "images") print_header();
  if (what.empty() || what == "features") {
    Experiment experiment(path, feature_points(drive));
    experiment.run();
    experiment.print(world.c_str(), "features");
  }
  if (what.empty() || what == "lidar") {
    auto points = LidarPoints::make(spec, kRate_hz, cache / (world + ".points"));
    points.resize(drive.frames.size());
    Experiment experiment(path, points);
    experiment.run();
    experiment.print(world.c_str(), "lidar");
  }
  if (what.empty() || what == "images") report_images(world.c_str(), drive, path);
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  if (argc < 3) {
    return std::puts("usage: reverse_bench WORLD CACHE_FOLDER [features|lidar|images]"), 1;
  }
  camvox::bench::report(argv[1], argv[2], argc > 3 ? argv[3] : "");
}
