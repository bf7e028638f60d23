#include "pose_graph_builder.hpp"

#include <algorithm>
#include <numeric>
#include <unordered_map>

namespace camvox::loop {
namespace {

using optimization::PoseGraph;

/// Connected parts; the root of each is its first node.
class Parts {
 public:
  explicit Parts(std::size_t count) : root_(count) {
    std::iota(root_.begin(), root_.end(), std::size_t{0});
  }
  std::size_t root(std::size_t node) {
    while (root_[node] != node) node = root_[node] = root_[root_[node]];
    return node;
  }
  void join(std::size_t a, std::size_t b) {
    a = root(a);
    b = root(b);
    root_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::size_t> root_;
};

class Builder {
 public:
  Builder(const MapReplica& map, const LoopCloserConfig& config, CorrectionTask& task)
      : map_(map), config_(config), task_(task) {
    for (const auto& [id, keyframe] : map.keyframes()) {
      node_of_[id] = task.keyframe_ids.size();
      task.keyframe_ids.push_back(id);
      task.graph.T_map_node.push_back(keyframe.T_map_camera);
    }
  }

  void add_map() {
    for (const auto& [id, keyframe] : map_.keyframes()) {
      if (keyframe.parent != 0) add_edge(keyframe.parent, id, &keyframe.covariance);
      for (const auto& [other, landmarks] : keyframe.shared_landmarks) {
        const bool once = other < id && other != keyframe.parent && map_.find(other)->parent != id;
        if (once && landmarks >= config_.essential_landmarks) {
          add_edge(other, id, nullptr);
        }
      }
    }
  }

  /// Edges between the same few keyframes repeat each other: together they are worth one chain.
  void share_information() {
    const auto nodes = std::max<std::size_t>(task_.keyframe_ids.size(), 2);
    const double repeated =
        static_cast<double>(task_.graph.edges.size()) / static_cast<double>(nodes - 1);
    for (auto& edge : task_.graph.edges) edge.covariance_to *= std::max(1.0, repeated);
  }

  void add_loop(const LoopMeasurement& loop) {
    const geometry::Matrix6d covariance =
        loop.covariance_query + path_sigma(0.0, config_.drift).covariance();
    task_.graph.edges.push_back({node_of_.at(loop.match_id),
                                 node_of_.at(loop.query_id),
                                 loop.T_match_query,
                                 covariance,
                                 true});
    task_.robust_edges.emplace_back(loop.query_id, loop.match_id);
  }

  void fix_roots() {
    Parts parts(task_.keyframe_ids.size());
    for (const auto& edge : task_.graph.edges) parts.join(edge.from, edge.to);
    task_.graph.fixed.resize(task_.keyframe_ids.size());
    for (std::size_t i = 0; i < task_.keyframe_ids.size(); ++i) {
      task_.graph.fixed[i] = parts.root(i) == i;
    }
  }

 private:
  void add_edge(KeyframeId from, KeyframeId to, const geometry::Matrix6d* estimated) {
    const auto T_from_to = map_.relative_pose(from, to);
    geometry::Matrix6d covariance =
        path_sigma(T_from_to.translation().norm(), config_.drift).covariance();
    if (estimated != nullptr && estimated->allFinite()) covariance += *estimated;
    task_.graph.edges.push_back({node_of_.at(from), node_of_.at(to), T_from_to, covariance, false});
  }

  const MapReplica& map_;
  const LoopCloserConfig& config_;
  CorrectionTask& task_;
  std::unordered_map<KeyframeId, std::size_t> node_of_;
};

/// The robust cost has a minimum at the uncorrected map, however true the loops: far off, they have
/// hardly any weight. The other start is where all loops hold; that with the lower cost counts, so
/// loops must be worth what they bend.
optimization::PoseGraphSolution solve_from_best_start(const CorrectionTask& task) {
  auto all_hold = task.config;
  all_hold.kernel_width_sigma = 1e6;
  all_hold.relative_tolerance = 1e-2;  // only a start
  auto graph = task.graph;
  graph.T_map_node = optimization::solve_with_all_edges(graph, all_hold).T_map_node;
  auto best = optimization::solve_with_all_edges(graph, task.config);
  const bool certain =
      best.summary.usable && best.summary.cost_after < optimization::cost_of_doubt(task.config);
  if (!certain) {
    const auto as_is = optimization::solve_with_all_edges(task.graph, task.config);
    const bool better = best.summary.usable && best.summary.cost_after < as_is.summary.cost_after;
    if (!better) best = as_is;
  }
  auto solution = optimization::leave_out_outliers(task.graph, best, task.config);
  solution.summary.cost_before = optimization::cost(task.graph, task.graph.T_map_node, task.config);
  return solution;
}

}  // namespace

CorrectionTask build_correction(const MapReplica& map,
                                const std::deque<LoopMeasurement>& loops,
                                const LoopMeasurement& newest,
                                const LoopCloserConfig& config) {
  CorrectionTask task;
  task.map_epoch = map.map_epoch();
  task.loop = newest;
  task.config = config.pose_graph;
  Builder builder(map, config, task);
  builder.add_map();
  builder.share_information();
  for (const auto& loop : loops) builder.add_loop(loop);
  builder.fix_roots();
  return task;
}

Correction correct(const CorrectionTask& task) {
  const auto solution = solve_from_best_start(task);
  Correction correction;
  correction.map_epoch = task.map_epoch;
  correction.loop = task.loop;
  correction.summary = solution.summary;
  if (!solution.summary.usable) return correction;
  const std::size_t first_loop = task.graph.edges.size() - task.robust_edges.size();
  for (const auto edge : solution.outliers) {
    correction.rejected_loops.push_back(task.robust_edges[edge - first_loop]);
  }
  // Without its loops the graph says what the map says already: nothing to correct.
  if (correction.rejected_loops.size() == task.robust_edges.size()) return correction;
  for (std::size_t i = 0; i < task.keyframe_ids.size(); ++i) {
    correction.T_map_camera.emplace_back(task.keyframe_ids[i], solution.T_map_node[i]);
  }
  return correction;
}

}  // namespace camvox::loop
