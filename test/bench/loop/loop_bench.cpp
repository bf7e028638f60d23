#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <deque>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "camvox/component/progress.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "camvox/optimization/pose_graph.hpp"
#include "camvox/test/feature_world.hpp"
#include "pose_graph_builder.hpp"

/// Times of the place index up to 10 000 keyframes and of the pose graph, and what wrong loops do
/// to the map. Simulated; prints Markdown tables.
///   build/camvox_test/bench/loop/loop_bench [injection|pose_graph|index]
namespace camvox::bench {
namespace {

using geometry::SE3;

double quantile(std::vector<double> values, double q) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(q * static_cast<double>(values.size() - 1))];
}

/// Descriptors as a drive makes them: 50 000 kinds of corners; a keyframe shares most of its
/// corners with the one before; a tenth of the bits is wrong.
class Descriptors {
 public:
  Descriptors() {
    for (int i = 0; i < 50000; ++i)
      kinds_.push_back(test::FeatureWorld::random_descriptor(random_));
  }

  features::FrameFeatures next() {
    for (auto& corner : seen_) {
      if (random_() % 10 == 0) corner = kinds_[random_() % kinds_.size()];
    }
    features::FrameFeatures frame;
    frame.key_points.resize(seen_.size());
    for (const auto& corner : seen_) frame.descriptors.push_back(noisy(corner));
    return frame;
  }

 private:
  features::Descriptor noisy(features::Descriptor descriptor) {
    for (int i = 0; i < 26; ++i) {
      auto& byte = descriptor.bytes[random_() % 32];
      byte = static_cast<std::uint8_t>(byte ^ (1U << (random_() % 8)));
    }
    return descriptor;
  }

  std::mt19937 random_{1};
  std::vector<features::Descriptor> kinds_;
  std::vector<features::Descriptor> seen_ = std::vector<features::Descriptor>(1500);
};

void measure_index() {
  std::puts(
      "| keyframes | query ms, median / max | insert ms, median | index MB |\n| --- | --- | --- | "
      "--- |");
  Descriptors descriptors;
  loop::PlaceIndex index;
  std::vector<double> query_ms, insert_ms;
  for (std::uint64_t id = 1; id <= 10000; ++id) {
    const auto frame = descriptors.next();
    const double before_s = thread_processor_time_s();
    index.insert(id, frame);
    insert_ms.push_back(1e3 * (thread_processor_time_s() - before_s));
    const bool report = id == 1000 || id == 3000 || id == 10000;
    if (id % 50 == 0) {
      const double start_s = thread_processor_time_s();
      (void)index.query(frame);
      query_ms.push_back(1e3 * (thread_processor_time_s() - start_s));
    }
    if (!report) continue;
    std::printf("| %lu | %.1f / %.1f | %.2f | %.0f |\n",
                static_cast<unsigned long>(id),
                quantile(query_ms, 0.5),
                quantile(query_ms, 1.0),
                quantile(insert_ms, 0.5),
                1e-6 * static_cast<double>(index.bytes()));
    query_ms.clear();
    insert_ms.clear();
  }
}

/// Two rounds of a circle with drifting odometry and loops from the second to the first.
struct Circuit {
  Circuit(std::size_t nodes, unsigned seed) : random(seed) {
    const std::size_t period = nodes / 2;
    for (std::size_t i = 0; i < nodes; ++i) {
      const double angle = 2.0 * M_PI * static_cast<double>(i) / static_cast<double>(period);
      truth.push_back(test::on_circle(angle, 0.16 * static_cast<double>(period)));
    }
    map = {truth[0]};
    for (std::size_t i = 1; i < nodes; ++i) {
      map.push_back(map.back() * truth[i - 1].inverse() * truth[i] * noise(4e-4, 0.005));
    }
    for (std::size_t i = period; i < nodes; i += 5) {
      loops.push_back({i,
                       i - period,
                       truth[i - period].inverse() * truth[i] * noise(1e-3, 0.02),
                       covariance(1e-3, 0.02),
                       100});
    }
  }

  SE3 noise(double rotation_rad, double translation_m) {
    std::normal_distribution<double> unit;
    geometry::Vector6d xi;
    for (int k = 0; k < 6; ++k) xi[k] = unit(random) * (k < 3 ? rotation_rad : translation_m);
    return SE3::exp(xi);
  }
  static geometry::Matrix6d covariance(double rotation_rad, double translation_m) {
    return loop::PoseSigma{rotation_rad, translation_m}.covariance();
  }

  /// Half of them anywhere, half near the true match but off by a metre or two: no layer before
  /// the comparison of loops can tell these.
  void add_wrong_loops(std::size_t count) {
    const std::size_t period = truth.size() / 2;
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t query = period + random() % period;
      const std::size_t match = k % 2 == 0 ? random() % period : query - period;
      const SE3 T = k % 2 == 0 ? SE3() : truth[match].inverse() * truth[query];
      loops.push_back({query, match, T * noise(0.1, 1.0), covariance(1e-3, 0.02), 100});
    }
  }

  /// What mapping says when keyframe `i` (from 0) comes in: it shares landmarks with eight before.
  [[nodiscard]] static loop::MapChange neighbours(std::size_t i) {
    loop::MapChange change;
    for (std::size_t k = i > 8 ? i - 8 : 0; k < i; ++k) {
      change.edges.push_back({k + 1, i + 1, static_cast<int>(320 - 40 * (i - k))});
    }
    return change;
  }
  [[nodiscard]] tracking::Keyframe keyframe(std::size_t i, const SE3& T_map_camera) const {
    tracking::Keyframe keyframe;
    keyframe.id = i + 1;
    keyframe.parent_id = i;
    keyframe.T_map_camera = T_map_camera;
    keyframe.covariance_camera = covariance(4e-4, 0.005);
    return keyframe;
  }
  [[nodiscard]] static loop::LoopMeasurement by_id(loop::LoopMeasurement measurement) {
    ++measurement.query_id;
    ++measurement.match_id;
    return measurement;
  }

  /// The first `count` loops in one pose graph, as LoopCloser builds it.
  [[nodiscard]] loop::CorrectionTask correction_task(std::size_t count) const {
    loop::MapReplica replica;
    for (std::size_t i = 0; i < map.size(); ++i) {
      replica.insert(keyframe(i, map[i]));
      replica.apply(neighbours(i));
    }
    std::deque<loop::LoopMeasurement> measured;
    for (std::size_t i = 0; i < count; ++i) measured.push_back(by_id(loops[i]));
    return loop::build_correction(replica, measured, measured.back(), {});
  }

  /// ATE after them.
  [[nodiscard]] double graph_alone_m(std::size_t count) const {
    const auto correction = loop::correct(correction_task(count));
    auto poses = map;
    for (const auto& [id, T] : correction.T_map_camera) poses[id - 1] = T;
    return rmse_m(poses);
  }

  struct Driven {
    double rmse_m = 0.0;
    std::set<std::size_t> used_loops;  ///< Indices into `loops`.
  };

  /// The drive through LoopCloser, all its layers but the images: measurement after measurement is
  /// taken for verified, corrections are applied.
  [[nodiscard]] Driven drive(std::size_t count) const {
    loop::LoopCloser closer{loop::LoopCloserConfig()};
    std::vector<SE3> poses;
    std::uint64_t epoch = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      poses.push_back(i == 0 ? map[0] : poses.back() * map[i - 1].inverse() * map[i]);
      closer.insert(keyframe(i, poses.back()));
      closer.update(neighbours(i));
      std::vector<loop::VerifiedPlace> places;
      for (std::size_t k = 0; k < count; ++k) {
        if (loops[k].query_id != i) continue;
        loop::VerifiedPlace place{loops[k].match_id + 1, 1.0, {}};
        place.verification.status = loop::VerificationStatus::kOk;
        place.verification.T_place_query = loops[k].T_match_query;
        place.verification.covariance_query = loops[k].covariance_query;
        place.verification.inliers = 100;
        places.push_back(place);
      }
      const auto task = closer.consider(i + 1, places);
      if (!task) continue;
      const auto correction = loop::correct(*task);
      closer.finish(correction);
      loop::MapChange change;
      change.map_epoch = ++epoch;
      change.T_map_camera = correction.T_map_camera;
      for (const auto& [id, T] : correction.T_map_camera) poses[id - 1] = T;
      closer.update(change);
    }
    Driven driven;
    driven.rmse_m = rmse_m(poses);
    for (const auto& used : closer.loops()) {
      for (std::size_t k = 0; k < count; ++k) {
        const bool same = loops[k].query_id + 1 == used.query_id &&
                          loops[k].match_id + 1 == used.match_id &&
                          geometry::local(loops[k].T_match_query, used.T_match_query).norm() < 1e-9;
        if (same) driven.used_loops.insert(k);
      }
    }
    return driven;
  }

  [[nodiscard]] optimization::PoseGraph graph() const {
    optimization::PoseGraph graph;
    graph.T_map_node = map;
    graph.fixed.assign(map.size(), false);
    graph.fixed[0] = true;
    for (std::size_t i = 1; i < map.size(); ++i) {
      graph.edges.push_back(
          {i - 1, i, map[i - 1].inverse() * map[i], covariance(4e-4, 0.005), false});
    }
    for (const auto& l : loops) {
      graph.edges.push_back({l.match_id, l.query_id, l.T_match_query, l.covariance_query, false});
    }
    return graph;
  }

  [[nodiscard]] double rmse_m(const std::vector<SE3>& poses) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i)
      sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }

  std::mt19937 random;
  std::vector<SE3> truth, map;
  std::vector<loop::LoopMeasurement> loops;
};

/// A correction as LoopCloser makes it, from the graph of the map. With a wrong loop it is solved
/// from two starts and again without that loop.
void measure_correction(std::size_t nodes, std::size_t wrong_loops) {
  std::vector<double> wall_ms, cpu_ms;
  std::size_t edges = 0;
  for (unsigned seed = 1; seed <= 9; ++seed) {
    Circuit circuit(nodes, seed);
    circuit.loops.resize(3);
    circuit.add_wrong_loops(wrong_loops);
    const auto task = circuit.correction_task(circuit.loops.size());
    edges = task.graph.edges.size();
    const auto wall = std::chrono::steady_clock::now();
    const double cpu_s = thread_processor_time_s();
    (void)loop::correct(task);
    cpu_ms.push_back(1e3 * (thread_processor_time_s() - cpu_s));
    wall_ms.push_back(
        1e3 * std::chrono::duration<double>(std::chrono::steady_clock::now() - wall).count());
  }
  std::printf("| %zu | %zu | %zu | %.0f / %.0f | %.0f |\n",
              nodes,
              edges,
              wrong_loops,
              quantile(wall_ms, 0.5),
              quantile(wall_ms, 1.0),
              quantile(cpu_ms, 0.5));
}

void measure_pose_graph() {
  std::puts(
      "\n| poses | edges | wrong loops | wall ms, median / max of 9 | CPU ms, median |\n"
      "| --- | --- | --- | --- | --- |");
  for (const std::size_t nodes : {200U, 1000U, 2000U}) {
    for (const std::size_t wrong_loops : {0U, 1U}) measure_correction(nodes, wrong_loops);
  }
}

void inject_wrong_loops() {
  std::puts(
      "\n| wrong loops, % of all | ATE m: odometry | no kernel, all loops | LoopCloser's graph: "
      "clean | with wrong loops | LoopCloser's drive: clean | with wrong loops | right used | "
      "wrong "
      "used |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const Circuit clean(500, seed);
    const std::size_t right = clean.loops.size();
    const double clean_graph_m = clean.graph_alone_m(right);
    const double clean_drive_m = clean.drive(right).rmse_m;
    for (const double share : {0.05, 0.1, 0.2, 0.35, 0.5}) {
      Circuit circuit = clean;
      const double wrong = share / (1.0 - share) * static_cast<double>(right);
      circuit.add_wrong_loops(static_cast<std::size_t>(wrong));
      const double naive_m = circuit.rmse_m(optimization::solve(circuit.graph()).T_map_node);
      const auto driven = circuit.drive(circuit.loops.size());
      const auto used_right = static_cast<std::size_t>(
          std::distance(driven.used_loops.begin(), driven.used_loops.lower_bound(right)));
      std::printf("| %.0f | %.2f | %.2f | %.3f | %.3f | %.3f | %.3f | %zu of %zu | %zu |\n",
                  100.0 * share,
                  circuit.rmse_m(circuit.map),
                  naive_m,
                  clean_graph_m,
                  circuit.graph_alone_m(circuit.loops.size()),
                  clean_drive_m,
                  driven.rmse_m,
                  used_right,
                  right,
                  driven.used_loops.size() - used_right);
    }
  }
}

}  // namespace
}  // namespace camvox::bench

int main(int argc, char** argv) {
  const std::string only = argc > 1 ? argv[1] : "";
  const auto wanted = [&only](const char* name) { return only.empty() || only == name; };
  if (wanted("injection")) camvox::bench::inject_wrong_loops();
  if (wanted("pose_graph")) camvox::bench::measure_pose_graph();
  if (wanted("index")) camvox::bench::measure_index();
}
