// Drives round and round a site of 200 m without images, through tracking, mapping and loop
// closing on one thread, and prints every simulated minute how large the map has become:
//   soak_bench [--minutes 30] [--changing 0.3]
// The exit code is 1 if revisits of a world that stays the same let the map grow, or a keyframe
// takes more than its budget. In a world that changes, the map grows to place_keyframes a place.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <vector>

#include "camvox/loop/loop_closer.hpp"
#include "camvox/mapping/mapper.hpp"
#include "camvox/tracking/tracker.hpp"
#include "site_world.hpp"

namespace camvox::bench {
namespace {

using geometry::SE3;

constexpr double kSpeed_mps = 5.0;
constexpr double kPeriod_s = 0.1;
constexpr int kFramesPerMinute = 600;
constexpr double kBudgetPerKeyframe_kb = 512.0;  ///< MappingComponentConfig::keyframe_budget_kb.

double resident_mb() {
  std::ifstream file("/proc/self/statm");
  double all = 0.0, resident = 0.0;
  file >> all >> resident;
  return 1e-6 * resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

class Soak {
 public:
  Soak(unsigned seed, double changing, int place_keyframes)
      : world_(seed, changing),
        tracker_({}, world_.camera(), SiteWorld::T_body_camera()),
        mapper_(mapping_config(place_keyframes), world_.camera()),
        closer_({}) {}

  void step() {
    ++frame_id_;
    const double way_m = kSpeed_mps * kPeriod_s * static_cast<double>(frame_id_ - 1);
    const SE3 T_world_body = SiteWorld::T_world_body(way_m);
    world_.set_lap(static_cast<std::uint64_t>(way_m / SiteWorld::kLap_m));
    auto frame = world_.see(T_world_body * SiteWorld::T_body_camera(), frame_id_);
    frame.stamp_ns = static_cast<std::int64_t>(1e9 * kPeriod_s * static_cast<double>(frame_id_));
    auto result = tracker_.track(std::move(frame));
    if (result.keyframe) take_in(*result.keyframe);
    tracker_.update_map(mapper_.local_map(frame_id_, result.reference_keyframe_id));
    if (result.relocalisation_request) find(*result.relocalisation_request);
    lost_ += result.has_pose() ? 0 : 1;
    const SE3 T_first = SiteWorld::T_world_body(0.0);
    const SE3 T_map_body = result.T_map_camera * SiteWorld::T_body_camera().inverse();
    error_m_ = (T_first * T_map_body).translation() - T_world_body.translation();
  }

  [[nodiscard]] std::size_t keyframes() const { return mapper_.map().keyframes().size(); }
  [[nodiscard]] double keyframe_kb() const {
    return 1e-3 * static_cast<double>(mapper_.map().memory_bytes()) /
           static_cast<double>(keyframes());
  }

  void print() const {
    const double way_m = kSpeed_mps * kPeriod_s * static_cast<double>(frame_id_);
    const double map_mb = 1e-3 * keyframe_kb() * static_cast<double>(keyframes());
    std::printf("%6.1f %7.0f %5.1f %6zu %7zu %9zu %8.1f %7.1f %9.1f %6llu %5llu %6.2f\n",
                static_cast<double>(frame_id_) / kFramesPerMinute,
                way_m,
                way_m / SiteWorld::kLap_m,
                made_,
                keyframes(),
                mapper_.map().landmark_count(),
                map_mb,
                keyframe_kb(),
                resident_mb(),
                static_cast<unsigned long long>(closer_.statistics().corrections),
                static_cast<unsigned long long>(lost_),
                error_m_.norm());
    std::fflush(stdout);
  }

 private:
  static mapping::MappingConfig mapping_config(int place_keyframes) {
    mapping::MappingConfig config;
    config.place_keyframes = place_keyframes;
    config.full_bundle_iterations = 0;
    return config;
  }

  void take_in(const tracking::Keyframe& keyframe) {
    ++made_;
    mapper_.set_reference(keyframe.id);
    const auto report = mapper_.process(keyframe);
    if (!report.inserted) throw std::runtime_error("keyframe refused: " + report.problem);
    closer_.insert(keyframe);
    tell();
    const auto places =
        loop::verify(closer_.detect(keyframe.id), world_.camera().pinhole, closer_.config());
    const auto task = closer_.consider(keyframe.id, places);
    if (!task) return;
    const auto correction = loop::correct(*task);
    closer_.finish(correction);
    if (correction.T_map_camera.empty()) return;
    mapping::LoopProposal proposal{
        correction.map_epoch, correction.loop.query_id, correction.loop.match_id, {}};
    for (const auto& [id, T_map_camera] : correction.T_map_camera) {
      proposal.poses[id] = T_map_camera;
    }
    const auto problem = mapper_.correct(proposal);
    if (!problem.empty()) throw std::runtime_error("correction refused: " + problem);
    tell();
  }

  /// Loop closing's copy follows the map.
  void tell() {
    const auto changes = mapper_.take_changes();
    loop::MapChange change;
    change.map_epoch = mapper_.epoch();
    for (const auto& keyframe : changes.keyframes) {
      change.T_map_camera.emplace_back(keyframe.id, keyframe.T_map_camera);
    }
    change.removed = changes.removed;
    for (const auto& edge : changes.edges) change.edges.push_back({edge.a, edge.b, edge.shared});
    closer_.update(change);
  }

  void find(const tracking::Keyframe& request) {
    const auto task =
        closer_.detect_lost(std::make_shared<features::FrameFeatures>(request.features));
    const auto found =
        closer_.relocalise(loop::verify(task, world_.camera().pinhole, closer_.config()));
    if (!found) return tracker_.relocalisation_failed(request.frame_id);
    tracker_.relocalise(
        {request.frame_id, mapper_.epoch(), found->keyframe_ids.front(), found->T_map_camera});
  }

  SiteWorld world_;
  tracking::Tracker tracker_;
  mapping::Mapper mapper_;
  loop::LoopCloser closer_;
  std::uint64_t frame_id_ = 0;
  std::uint64_t lost_ = 0;
  std::size_t made_ = 0;
  Eigen::Vector3d error_m_ = Eigen::Vector3d::Zero();
};

int soak(int minutes, unsigned seed, double changing, int place_keyframes) {
  Soak soak(seed, changing, place_keyframes);
  std::printf(
      "   min       m  laps   made  in map landmarks   map MB  kB/kf  resident  loops  lost  "
      "error\n");
  const double lap_min = SiteWorld::kLap_m / kSpeed_mps / 60.0;
  std::size_t after_two_laps = 0;
  double worst_kb = 0.0;
  for (int minute = 1; minute <= minutes; ++minute) {
    for (int i = 0; i < kFramesPerMinute; ++i) soak.step();
    soak.print();
    if (minute <= static_cast<int>(std::ceil(2.0 * lap_min))) after_two_laps = soak.keyframes();
    worst_kb = std::max(worst_kb, soak.keyframe_kb());
  }
  const double growth = static_cast<double>(soak.keyframes()) / static_cast<double>(after_two_laps);
  std::printf(
      "keyframes at the end / after two laps: %.2f (at most 1.5 if nothing changes); at most %.0f "
      "kB each (budget "
      "%.0f)\n",
      growth,
      worst_kb,
      kBudgetPerKeyframe_kb);
  const bool grew = changing == 0.0 && growth > 1.5;
  return grew || worst_kb > kBudgetPerKeyframe_kb ? 1 : 0;
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  int minutes = 30;
  unsigned seed = 1;
  double changing = 0.0;
  int place_keyframes = camvox::mapping::MappingConfig().place_keyframes;
  CLI::App app("Memory of the map over a long drive on a small site");
  app.add_option("--minutes", minutes, "of simulated driving at 5 m/s");
  app.add_option("--seed", seed);
  app.add_option("--changing", changing, "share of points that look different in every lap");
  app.add_option("--place-keyframes", place_keyframes, "keyframes at one place, at most");
  CLI11_PARSE(app, argc, argv);
  return camvox::bench::soak(minutes, seed, changing, place_keyframes);
}
