#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <set>

#include "camvox/component/progress.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "drive.hpp"
#include "reverse/there_and_back.hpp"

/// Loop closing alone on a simulated drive: keyframes with true features and drifting odometry;
/// corrections are applied as mapping would, without bundle adjustment. Prints Markdown rows, by
/// images alone and with the surfaces of places passed in another direction.
///   drive_bench loop_400m|campus_1800m|street|plaza|corridor CACHE_FOLDER [RATE_HZ] [SEEDS]
namespace camvox::bench {
namespace {

using geometry::SE3;

/// Odometry with a constant and a random part, as a tracker's: relative to the distance driven.
std::vector<SE3> drifted(const std::vector<tracking::Keyframe>& frames, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> unit;
  const double yaw_bias_rad_per_m = 1e-4 * unit(random);
  const double scale = 1.0 + 0.003 * unit(random);
  std::vector<SE3> poses = {frames.front().T_map_camera};
  for (std::size_t i = 1; i < frames.size(); ++i) {
    const SE3 T = frames[i - 1].T_map_camera.inverse() * frames[i].T_map_camera;
    const double step_m = T.translation().norm();
    geometry::Vector6d noise;
    for (int k = 0; k < 6; ++k) noise[k] = unit(random) * (k < 3 ? 2e-4 : 3e-3) * std::sqrt(step_m);
    noise[1] += yaw_bias_rad_per_m * step_m;
    const SE3 measured(T.rotation(), scale * T.translation());
    poses.push_back(poses.back() * measured * SE3::exp(noise));
  }
  return poses;
}

/// After alignment of the first pose only: what a user sees on a map.
double rmse_m(const std::vector<tracking::Keyframe>& truth, const std::vector<SE3>& poses) {
  Eigen::Matrix3Xd a(3, truth.size()), b(3, truth.size());
  for (std::size_t i = 0; i < truth.size(); ++i) {
    a.col(static_cast<Eigen::Index>(i)) = poses[i].translation();
    b.col(static_cast<Eigen::Index>(i)) = truth[i].T_map_camera.translation();
  }
  const Eigen::Matrix4d T = Eigen::umeyama(a, b, false);
  const Eigen::Matrix3Xd aligned =
      (T.topLeftCorner<3, 3>() * a).colwise() + T.topRightCorner<3, 1>();
  return std::sqrt((aligned - b).colwise().squaredNorm().mean());
}

struct Result {
  double odometry_m = 0.0;
  double ate_m = 0.0;
  std::set<std::size_t> closed;  ///< Frames with an accepted loop.
  int false_loops = 0;
  double worst_loop_m = 0.0;
  double worst_loop_deg = 0.0;
  int wrong_surfaces = 0;               ///< Confirmed, and false.
  std::vector<double> surface_sigma;    ///< Of those confirmed: error in its own sigma, / sqrt(6).
  std::vector<double> surface_error_m;  ///< The same, in metres.
  std::vector<double> detect_ms, verify_ms, keyframe_ms, solve_ms;
  loop::LoopStatistics statistics;
};

/// Keyframes whose images overlap in the tracker's way: within 4 m and 15 degrees on the path.
loop::MapChange neighbour_edges(const std::vector<tracking::Keyframe>& frames, std::size_t i) {
  loop::MapChange change;
  for (std::size_t k = i > 8 ? i - 8 : 0; k < i; ++k) {
    const SE3 T = frames[k].T_map_camera.inverse() * frames[i].T_map_camera;
    const double far = T.translation().norm() / 8.0 + T.rotation().angle_rad() / 0.5;
    if (far < 1.0) change.edges.push_back({k + 1, i + 1, static_cast<int>(300 * (1.0 - far)) + 1});
  }
  return change;
}

/// Of a pose: whether a loop with it is a false one.
bool is_false(const geometry::Vector6d& error) {
  return error.tail<3>().norm() > 0.5 || error.head<3>().norm() > 0.05;
}

void look_at(const loop::VerifiedPlace& place, const SE3& T_match_query, Result& result) {
  const auto& found = place.verification;
  if (!place.by_surfaces || found.status != loop::VerificationStatus::kOk) return;
  const auto error = geometry::local(T_match_query, found.T_place_query);
  result.wrong_surfaces += is_false(error) ? 1 : 0;
  const double squared = error.dot(found.covariance_query.ldlt().solve(error));
  result.surface_sigma.push_back(std::sqrt(squared / 6.0));
  result.surface_error_m.push_back(error.tail<3>().norm());
}

void print(std::uint64_t query, const loop::VerifiedPlace& place, const SE3& T_match_query) {
  const auto& found = place.verification;
  std::printf(
      "%lu -> %lu true %.1f m %.0f deg: score %.2f %s%s matches %d ransac %d inliers %d cells %d "
      "depth %.2f of %d err %.2f\n",
      static_cast<unsigned long>(query),
      static_cast<unsigned long>(place.match_id),
      T_match_query.translation().norm(),
      57.3 * T_match_query.rotation().angle_rad(),
      place.score,
      place.by_surfaces ? "surfaces: " : "",
      std::string(to_string(found.status)).c_str(),
      found.matches,
      found.ransac_inliers,
      found.inliers,
      found.cells,
      found.depth_agreement,
      found.depths_compared,
      geometry::local(T_match_query, found.T_place_query).tail<3>().norm());
}

Result run(const Drive& drive, unsigned seed, bool surfaces) {
  Result result;
  const auto odometry = drifted(drive.frames, seed);
  result.odometry_m = rmse_m(drive.frames, odometry);
  loop::LoopCloserConfig config;
  config.surfaces.enabled = surfaces;
  loop::LoopCloser closer{config};
  std::vector<SE3> poses;
  std::uint64_t epoch = 0;
  for (std::size_t i = 0; i < drive.frames.size(); ++i) {
    auto keyframe = drive.frames[i];
    keyframe.id = i + 1;
    keyframe.parent_id = i;
    keyframe.T_map_camera =
        i == 0 ? odometry[0] : poses.back() * odometry[i - 1].inverse() * odometry[i];
    poses.push_back(keyframe.T_map_camera);
    const double t0 = thread_processor_time_s();
    closer.insert(keyframe);
    closer.update(neighbour_edges(drive.frames, i));
    const auto task = closer.detect(keyframe.id);
    const double t1 = thread_processor_time_s();
    result.detect_ms.push_back(1e3 * (t1 - t0));
    const auto places = loop::verify(task, drive.camera, closer.config());
    for (const auto& place : places) {
      const SE3 T =
          drive.frames[place.match_id - 1].T_map_camera.inverse() * drive.frames[i].T_map_camera;
      look_at(place, T, result);
      if (std::getenv("VERBOSE") != nullptr) print(keyframe.id, place, T);
    }
    if (!task.empty()) {
      result.verify_ms.push_back(1e3 * (thread_processor_time_s() - t1));
    }
    const auto correction_task = closer.consider(keyframe.id, places);
    const double t2 = thread_processor_time_s();
    result.keyframe_ms.push_back(1e3 * (t2 - t0));
    if (!correction_task) continue;
    const auto correction = loop::correct(*correction_task);
    result.solve_ms.push_back(1e3 * (thread_processor_time_s() - t2));
    closer.finish(correction);
    if (std::getenv("VERBOSE") != nullptr) std::puts(correction.summary.to_string().c_str());
    loop::MapChange change;
    change.map_epoch = ++epoch;
    change.T_map_camera = correction.T_map_camera;
    for (const auto& [id, T] : correction.T_map_camera) poses[id - 1] = T;
    closer.update(change);
  }
  result.ate_m = rmse_m(drive.frames, poses);
  for (const auto& loop : closer.loops()) {
    const SE3 T = drive.frames[loop.match_id - 1].T_map_camera.inverse() *
                  drive.frames[loop.query_id - 1].T_map_camera;
    const auto error = geometry::local(T, loop.T_match_query);
    result.worst_loop_m = std::max(result.worst_loop_m, error.tail<3>().norm());
    result.worst_loop_deg = std::max(result.worst_loop_deg, 57.3 * error.head<3>().norm());
    result.false_loops += is_false(error) ? 1 : 0;
    result.closed.insert(loop.query_id - 1);
  }
  result.statistics = closer.statistics();
  return result;
}

/// Revisits in the same direction: an older frame within 3 m and 30 degrees, 25 m or more before.
std::vector<std::vector<std::size_t>> revisits(const Drive& drive) {
  std::vector<std::vector<std::size_t>> stretches;
  std::vector<double> travelled_m = {0.0};
  for (std::size_t i = 1; i < drive.frames.size(); ++i) {
    travelled_m.push_back(travelled_m.back() + (drive.frames[i].T_map_camera.translation() -
                                                drive.frames[i - 1].T_map_camera.translation())
                                                   .norm());
    bool again = false;
    for (std::size_t k = 0; k < i && !again; ++k) {
      const SE3 T = drive.frames[k].T_map_camera.inverse() * drive.frames[i].T_map_camera;
      again = T.translation().norm() < 3.0 && T.rotation().angle_rad() < 0.52 &&
              travelled_m[i] - travelled_m[k] > 25.0;
    }
    if (!again) continue;
    if (stretches.empty() || stretches.back().back() + 1 < i) stretches.emplace_back();
    stretches.back().push_back(i);
  }
  std::erase_if(stretches, [&](const auto& s) {
    return travelled_m[s.back()] - travelled_m[s.front()] < 20.0;
  });
  return stretches;
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void print_row(unsigned seed,
               const char* by,
               const Result& r,
               const std::vector<std::vector<std::size_t>>& stretches) {
  const auto closed = std::count_if(stretches.begin(), stretches.end(), [&](const auto& stretch) {
    return std::any_of(
        stretch.begin(), stretch.end(), [&](std::size_t i) { return r.closed.contains(i); });
  });
  const auto& counts = r.statistics;
  const auto number = [](std::uint64_t count) { return static_cast<unsigned long>(count); };
  std::printf("| %u, %s | %.2f | %.3f | %ld of %zu | %lu, %lu | %d | %.2f m %.2f deg | ",
              seed,
              by,
              r.odometry_m,
              r.ate_m,
              static_cast<long>(closed),
              stretches.size(),
              number(counts.loops),
              number(counts.surface_loops),
              r.false_loops,
              r.worst_loop_m,
              r.worst_loop_deg);
  std::printf("%lu, %lu, %d | %.2f / %.2f m, %.1f / %.1f | %lu, %lu, %lu | ",
              number(counts.surfaces_compared),
              number(counts.surfaces_confirmed),
              r.wrong_surfaces,
              quantile(r.surface_error_m, 0.5),
              quantile(r.surface_error_m, 1.0),
              quantile(r.surface_sigma, 0.5),
              quantile(r.surface_sigma, 1.0),
              number(counts.implausible),
              number(counts.ambiguous),
              number(counts.loops_left_out));
  std::printf("%.1f / %.1f | %.1f / %.1f | %.1f / %.1f | %.0f |\n",
              quantile(r.detect_ms, 0.5),
              quantile(r.detect_ms, 1.0),
              quantile(r.verify_ms, 0.5),
              quantile(r.verify_ms, 1.0),
              quantile(r.keyframe_ms, 0.5),
              quantile(r.keyframe_ms, 1.0),
              quantile(r.solve_ms, 1.0));
}

void report(const Drive& drive, unsigned seeds) {
  const auto stretches = revisits(drive);
  std::printf("%zu keyframes, %zu same-direction revisits of at least 20 m\n\n",
              drive.frames.size(),
              stretches.size());
  std::puts(
      "| odometry seed | ATE odometry m | ATE m | revisits closed | loops, by surfaces | false | "
      "worst loop | surfaces compared, confirmed, wrong | their error, median / max, in sigma | "
      "implausible, ambiguous, left out | detect ms, median / max | verify ms | keyframe ms in all "
      "| pose graph ms, max |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | "
      "--- | --- | --- |");
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    print_row(seed, "images", run(drive, seed, false), stretches);
    print_row(seed, "surfaces too", run(drive, seed, true), stretches);
  }
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  if (argc < 3) return std::puts("usage: drive_bench WORLD CACHE_FOLDER [RATE_HZ] [SEEDS]"), 1;
  const std::string world = argv[1];
  const double rate_hz = argc > 3 ? std::atof(argv[3]) : 2.0;
  const auto cache = std::filesystem::path(argv[2]) / (world + ".keyframes");
  const auto spec = camvox::bench::ThereAndBack::make(world);
  const auto drive = camvox::bench::Drive::make(spec.options, rate_hz, cache, spec.trajectory);
  camvox::bench::report(drive, argc > 4 ? static_cast<unsigned>(std::atoi(argv[4])) : 5);
}
