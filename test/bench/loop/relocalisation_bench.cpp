#include <algorithm>
#include <cstdio>
#include <map>
#include <random>

#include "camvox/component/progress.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "red_kitchen.hpp"

/// Relocalisation on 7-Scenes RedKitchen, without tracking and mapping: keyframes are every n-th
/// frame with its true pose. Prints Markdown tables.
///   build/camvox_test/bench/loop/relocalisation_bench ../shared/data/redkitchen [TRAJECTORY.tum]
/// The truth is KinectFusion's and drifts by centimetres in a second; so a second table takes the
/// poses of a run of camvox through the whole sequence, without a gap, for true:
///   camvox run rgbd.yaml --bag redkitchen --parameters redkitchen/rig.yaml --lockstep --out DIR
namespace camvox::bench {
namespace {

constexpr double kDegPerRad = 57.29577951308232;
constexpr std::size_t kFramesIn3s = 90;
constexpr std::size_t kFramesPerRequest = 3;  // a lost tracker asks ten times a second

struct Outcome {
  int asked = 0;
  int found = 0;
  int right = 0;
  int wrong = 0;
  std::vector<double> error_m;
  std::vector<double> error_deg;
  std::vector<double> waited_s;
  std::vector<double> request_ms;
  std::map<std::string, int> reasons;
};

loop::LoopCloser make_map(const RedKitchen& scene, std::size_t last, std::size_t step) {
  loop::LoopCloser closer{loop::LoopCloserConfig()};
  std::uint64_t id = 0;
  for (std::size_t i = 0; i < last; i += step) {
    auto keyframe = scene.frames[i];
    keyframe.id = ++id;
    keyframe.parent_id = id - 1;
    closer.insert(keyframe);
  }
  return closer;
}

void judge(const geometry::SE3& truth, const loop::Relocalisation& answer, Outcome& outcome) {
  const auto error = geometry::local(truth, answer.T_map_camera);
  const double error_m = error.tail<3>().norm();
  const double error_deg = kDegPerRad * error.head<3>().norm();
  ++outcome.found;
  outcome.error_m.push_back(error_m);
  outcome.error_deg.push_back(error_deg);
  outcome.right += error_m < 0.05 && error_deg < 2.0 ? 1 : 0;
  outcome.wrong += error_m > 0.15 || error_deg > 5.0 ? 1 : 0;
}

/// Asks with frame after frame for 3 s, as a lost tracker does.
void ask(const RedKitchen& scene,
         const loop::LoopCloser& closer,
         std::size_t start,
         Outcome& outcome) {
  ++outcome.asked;
  const auto end = std::min(start + kFramesIn3s, scene.frames.size());
  for (std::size_t i = start; i < end; i += kFramesPerRequest) {
    const auto frame = std::make_shared<features::FrameFeatures>(scene.frames[i].features);
    const double before_s = thread_processor_time_s();
    const auto places = loop::verify(closer.detect_lost(frame), scene.camera, closer.config());
    const auto answer = closer.relocalise(places);
    outcome.request_ms.push_back(1e3 * (thread_processor_time_s() - before_s));
    for (const auto& place : places) {
      ++outcome.reasons[std::string(to_string(place.verification.status))];
    }
    if (!answer) continue;
    outcome.waited_s.push_back(static_cast<double>(i - start) / 30.0);
    judge(scene.frames[i].T_map_camera, *answer, outcome);
    return;
  }
}

double quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

void print(const std::string& name, const Outcome& o) {
  std::printf("| %s | %d | %d | %d | %d | %.3f / %.3f | %.2f / %.2f | %.1f | %.0f / %.0f |\n",
              name.c_str(),
              o.asked,
              o.found,
              o.right,
              o.wrong,
              quantile(o.error_m, 0.5),
              quantile(o.error_m, 1.0),
              quantile(o.error_deg, 0.5),
              quantile(o.error_deg, 1.0),
              quantile(o.waited_s, 1.0),
              quantile(o.request_ms, 0.5),
              quantile(o.request_ms, 1.0));
  for (const auto& [reason, count] : o.reasons) {
    std::fprintf(stderr, "  places: %d %s\n", count, reason.c_str());
  }
}

void random_starts(const RedKitchen& scene, std::size_t step) {
  Outcome outcome;
  std::mt19937 random(1);
  const auto closer = make_map(scene, scene.frames.size(), step);
  while (outcome.asked < 50) {
    const std::size_t start = random() % scene.frames.size();
    if (start % step != 0) ask(scene, closer, start, outcome);
  }
  print("random starts, a keyframe every " + std::to_string(step) + " frames", outcome);
}

void blind_gap(const RedKitchen& scene) {
  Outcome outcome;
  for (std::size_t last = 100; last + 100 + kFramesIn3s < scene.frames.size(); last += 10) {
    ask(scene, make_map(scene, last, 10), last + 100, outcome);
  }
  print("after a blind gap of 100 frames", outcome);
}

/// How well the poses of two frames agree with what their images say, each pair by itself: wrong
/// poses show here without any map.
void judge_poses(const RedKitchen& scene) {
  std::puts("\n| frames between a pair | pairs | poses against images m, median | deg |");
  std::puts("| --- | --- | --- | --- |");
  for (const std::size_t gap : {5U, 20U, 40U, 200U}) {
    std::vector<double> error_m, error_deg;
    for (std::size_t i = 0; i + gap < scene.frames.size(); i += 7) {
      const auto& a = scene.frames[i];
      const auto& b = scene.frames[i + gap];
      const auto seen = loop::verify(b.features, {{&a.features, {}}}, scene.camera, {});
      if (seen.status != loop::VerificationStatus::kOk) continue;
      const auto error =
          geometry::local(a.T_map_camera.inverse() * b.T_map_camera, seen.T_place_query);
      error_m.push_back(error.tail<3>().norm());
      error_deg.push_back(kDegPerRad * error.head<3>().norm());
    }
    std::printf("| %zu | %zu | %.4f | %.2f |\n",
                gap,
                error_m.size(),
                quantile(error_m, 0.5),
                quantile(error_deg, 0.5));
  }
}

void measure(const RedKitchen& scene) {
  std::puts(
      "| case | asked | found | within 5 cm, 2 deg | wrong (> 15 cm, 5 deg) | error m, median / "
      "max | deg | waited s, max | CPU ms per request, median / max |\n"
      "| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
  for (const std::size_t step : {10U, 20U, 40U}) random_starts(scene, step);
  blind_gap(scene);
  judge_poses(scene);
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  camvox::bench::RedKitchen scene(argc > 1 ? argv[1] : "../shared/data/redkitchen");
  if (scene.frames.empty()) return std::puts("no frames there"), 2;
  std::puts("Poses: KinectFusion's\n");
  camvox::bench::measure(scene);
  if (argc < 3) return 0;
  if (!scene.take_poses(argv[2])) return std::puts("not a trajectory of all frames"), 2;
  std::printf("\nPoses: %s\n\n", argv[2]);
  camvox::bench::measure(scene);
}
