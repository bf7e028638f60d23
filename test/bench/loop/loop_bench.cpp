#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

#include "camvox/component/progress.hpp"
#include "camvox/loop/consistency.hpp"
#include "camvox/loop/place_index.hpp"
#include "camvox/optimization/pose_graph.hpp"
#include "camvox/test/feature_world.hpp"

/// Times of the place index up to 10 000 keyframes and of the pose graph, and what wrong loops do
/// to the map. Simulated; prints Markdown tables.
///   build/camvox_test/bench/loop/loop_bench
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

  void add_wrong_loops(double share) {
    const auto count =
        static_cast<std::size_t>(share / (1.0 - share) * static_cast<double>(loops.size()));
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t query = truth.size() / 2 + random() % (truth.size() / 2);
      const std::size_t match = random() % (truth.size() / 2);
      loops.push_back({query, match, noise(0.1, 1.0), covariance(1e-3, 0.02), 100});
    }
  }

  /// The largest set of loops that agree pairwise, with what odometry says between their ends.
  [[nodiscard]] std::vector<loop::LoopMeasurement> consistent_loops() const {
    const loop::DriftConfig config;
    std::vector<std::vector<bool>> adjacent(loops.size(), std::vector<bool>(loops.size(), false));
    const double step_m = (map[1].translation() - map[0].translation()).norm();
    const auto path_m = [&](std::size_t a, std::size_t b) {
      return step_m * std::abs(static_cast<double>(a) - static_cast<double>(b));
    };
    for (std::size_t i = 0; i < loops.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto& a = loops[i];
        const auto& b = loops[j];
        const loop::LoopPair pair{&a,
                                  &b,
                                  map[a.query_id].inverse() * map[b.query_id],
                                  map[a.match_id].inverse() * map[b.match_id],
                                  path_m(a.query_id, b.query_id),
                                  path_m(a.match_id, b.match_id)};
        adjacent[i][j] = adjacent[j][i] = loop::consistent(pair, config);
      }
    }
    std::vector<loop::LoopMeasurement> chosen;
    for (const auto index : loop::maximum_clique(adjacent)) chosen.push_back(loops[index]);
    return chosen;
  }

  [[nodiscard]] optimization::PoseGraph graph(const std::vector<loop::LoopMeasurement>& chosen,
                                              bool robust) const {
    optimization::PoseGraph graph;
    graph.T_map_node = map;
    graph.fixed.assign(map.size(), false);
    graph.fixed[0] = true;
    for (std::size_t i = 1; i < map.size(); ++i) {
      graph.edges.push_back(
          {i - 1, i, map[i - 1].inverse() * map[i], covariance(4e-4, 0.005), false});
    }
    for (const auto& l : chosen) {
      graph.edges.push_back({l.match_id, l.query_id, l.T_match_query, l.covariance_query, robust});
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

void measure_pose_graph() {
  std::puts("\n| poses | edges | CPU ms, median / max of 5 |\n| --- | --- | --- |");
  for (const std::size_t nodes : {200U, 1000U, 4000U}) {
    std::vector<double> time_ms;
    std::size_t edges = 0;
    for (unsigned seed = 1; seed <= 5; ++seed) {
      const Circuit circuit(nodes, seed);
      const auto graph = circuit.graph(circuit.loops, true);
      const double before_s = thread_processor_time_s();
      (void)optimization::solve(graph);
      time_ms.push_back(1e3 * (thread_processor_time_s() - before_s));
      edges = graph.edges.size();
    }
    std::printf("| %zu | %zu | %.0f / %.0f |\n",
                nodes,
                edges,
                quantile(time_ms, 0.5),
                quantile(time_ms, 1.0));
  }
}

void inject_wrong_loops() {
  std::puts(
      "\n| wrong loops, % of all | ATE m: odometry | clean | all loops, no kernel | consistent "
      "set, kernel | wrong loops used |\n| --- | --- | --- | --- | --- | --- |");
  for (const double share : {0.05, 0.1, 0.2, 0.35, 0.5}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      Circuit circuit(500, seed);
      const std::size_t right = circuit.loops.size();
      const double clean_m =
          circuit.rmse_m(optimization::solve(circuit.graph(circuit.loops, true)).T_map_node);
      circuit.add_wrong_loops(share);
      const double naive_m =
          circuit.rmse_m(optimization::solve(circuit.graph(circuit.loops, false)).T_map_node);
      const auto chosen = circuit.consistent_loops();
      const double robust_m =
          circuit.rmse_m(optimization::solve(circuit.graph(chosen, true)).T_map_node);
      const auto wrong = std::count_if(chosen.begin(), chosen.end(), [&](const auto& l) {
        return std::none_of(
            circuit.loops.begin(),
            circuit.loops.begin() + static_cast<std::ptrdiff_t>(right),
            [&](const auto& r) { return r.query_id == l.query_id && r.match_id == l.match_id; });
      });
      std::printf("| %.0f | %.2f | %.3f | %.2f | %.3f | %ld |\n",
                  100.0 * share,
                  circuit.rmse_m(circuit.map),
                  clean_m,
                  naive_m,
                  robust_m,
                  static_cast<long>(wrong));
    }
  }
}

}  // namespace
}  // namespace camvox::bench

int main() {
  camvox::bench::inject_wrong_loops();
  camvox::bench::measure_pose_graph();
  camvox::bench::measure_index();
}
