#include "camvox/features/match.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "camvox/features/hamming.hpp"

namespace camvox::features {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;

bool is_distinct(int distance, int second_distance, const MatchConfig& config) {
  return config.max_ratio >= 1.0 || distance < config.max_ratio * second_distance;
}

/// The matches to each target, nearest query first come: one query per target.
class Assignment {
 public:
  explicit Assignment(std::size_t targets) : best_(targets, {kNone, 0, kDescriptorBits + 1}) {}

  void offer(const Match& match) {
    Match& best = best_[match.target];
    if (match.distance < best.distance) best = match;
  }
  [[nodiscard]] std::vector<Match> matches() const {
    std::vector<Match> all;
    for (const Match& match : best_) {
      if (match.query != kNone) all.push_back(match);
    }
    std::sort(
        all.begin(), all.end(), [](const Match& a, const Match& b) { return a.query < b.query; });
    return all;
  }

 private:
  std::vector<Match> best_;
};

/// Finds the two nearest of some candidates, the second counted only within the octave of the
/// nearest.
class OctaveSearch {
 public:
  explicit OctaveSearch(const FrameFeatures& frame) : frame_(frame) {}

  Nearest find(const Descriptor& query, std::span<const std::uint32_t> candidates) {
    Nearest nearest;
    if (candidates.empty()) return nearest;
    distances_.resize(candidates.size());
    hamming_distances(query, frame_.descriptors, candidates, distances_);
    const auto best = std::min_element(distances_.begin(), distances_.end());
    const auto index = candidates[static_cast<std::size_t>(best - distances_.begin())];
    nearest.index = static_cast<int>(index);
    nearest.distance = *best;
    const auto octave = frame_.key_points[index].octave;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (distances_[i] >= nearest.second_distance || candidates[i] == index) continue;
      if (frame_.key_points[candidates[i]].octave == octave)
        nearest.second_distance = distances_[i];
    }
    return nearest;
  }

 private:
  const FrameFeatures& frame_;
  std::vector<std::uint16_t> distances_;
};

std::vector<float> angles_of(std::span<const KeyPoint> key_points) {
  std::vector<float> angles_rad;
  angles_rad.reserve(key_points.size());
  for (const KeyPoint& key_point : key_points) angles_rad.push_back(key_point.angle_rad);
  return angles_rad;
}

/// The range of entries with the node of the first.
std::span<const WordEntry> node_range(std::span<const WordEntry> words) {
  std::size_t end = 1;
  while (end < words.size() && words[end].node == words.front().node) ++end;
  return words.first(end);
}

}  // namespace

void keep_consistent_rotations(std::span<const float> query_angles_rad,
                               std::span<const KeyPoint> targets,
                               std::vector<Match>& matches) {
  constexpr int kBins = 30;
  constexpr float kTurn = 2.0F * std::numbers::pi_v<float>;
  const auto bin_of = [&](const Match& match) {
    float turn_rad = targets[match.target].angle_rad - query_angles_rad[match.query];
    if (turn_rad < 0.0F) turn_rad += kTurn;
    return static_cast<std::size_t>(std::lround(turn_rad * kBins / kTurn)) % kBins;
  };
  std::array<int, kBins> counts{};
  for (const Match& match : matches) ++counts[bin_of(match)];
  std::array<int, kBins> sorted = counts;
  std::sort(sorted.begin(), sorted.end(), std::greater<>());
  const int least = std::max({sorted[2], (sorted[0] + 9) / 10, 1});
  std::erase_if(matches, [&](const Match& match) { return counts[bin_of(match)] < least; });
}

std::vector<Match> match_by_projection(std::span<const Expected> expected,
                                       const FrameFeatures& frame,
                                       const FeatureGrid& grid,
                                       std::span<const std::uint8_t> taken,
                                       const MatchConfig& config) {
  Assignment assignment(frame.size());
  OctaveSearch search(frame);
  std::vector<std::uint32_t> candidates;
  std::vector<float> angles_rad;
  for (std::size_t query = 0; query < expected.size(); ++query) {
    angles_rad.push_back(expected[query].angle_rad);
    grid.find(expected[query].area, candidates);
    if (!taken.empty()) {
      std::erase_if(candidates, [&](std::uint32_t candidate) { return taken[candidate] != 0; });
    }
    const Nearest nearest = search.find(expected[query].descriptor, candidates);
    if (nearest.index < 0 || nearest.distance > config.max_distance) continue;
    if (!is_distinct(nearest.distance, nearest.second_distance, config)) continue;
    assignment.offer({static_cast<std::uint32_t>(query),
                      static_cast<std::uint32_t>(nearest.index),
                      nearest.distance});
  }
  std::vector<Match> matches = assignment.matches();
  if (config.check_rotation) keep_consistent_rotations(angles_rad, frame.key_points, matches);
  return matches;
}

std::vector<Match> match_by_neighbourhood(const FrameFeatures& from,
                                          const FrameFeatures& to,
                                          const FeatureGrid& grid_to,
                                          float radius_px,
                                          const MatchConfig& config) {
  std::vector<Expected> expected(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const KeyPoint& key_point = from.key_points[i];
    expected[i].area.u_px = from.undistorted_px.empty()
                                ? Eigen::Vector2f(key_point.u_px, key_point.v_px)
                                : from.undistorted_px[i];
    expected[i].area.radius_px = radius_px;
    expected[i].area.min_octave = key_point.octave - 1;
    expected[i].area.max_octave = key_point.octave + 1;
    expected[i].descriptor = from.descriptors[i];
    expected[i].angle_rad = key_point.angle_rad;
  }
  return match_by_projection(expected, to, grid_to, {}, config);
}

std::vector<Match> match_by_words(const FrameFeatures& from,
                                  std::span<const WordEntry> words_from,
                                  const FrameFeatures& to,
                                  std::span<const WordEntry> words_to,
                                  const MatchConfig& config) {
  Assignment assignment(to.size());
  std::vector<std::uint32_t> candidates;
  while (!words_from.empty() && !words_to.empty()) {
    const auto group_from = node_range(words_from);
    const auto group_to = node_range(words_to);
    if (group_from.front().node == group_to.front().node) {
      candidates.clear();
      for (const WordEntry& word : group_to) candidates.push_back(word.feature);
      for (const WordEntry& word : group_from) {
        const Nearest nearest =
            nearest_descriptor(from.descriptors[word.feature], to.descriptors, candidates);
        if (nearest.distance > config.max_distance) continue;
        if (!is_distinct(nearest.distance, nearest.second_distance, config)) continue;
        assignment.offer(
            {word.feature, static_cast<std::uint32_t>(nearest.index), nearest.distance});
      }
    }
    const bool from_first = group_from.front().node <= group_to.front().node;
    const bool to_first = group_to.front().node <= group_from.front().node;
    if (from_first) words_from = words_from.subspan(group_from.size());
    if (to_first) words_to = words_to.subspan(group_to.size());
  }
  std::vector<Match> matches = assignment.matches();
  if (config.check_rotation) {
    keep_consistent_rotations(angles_of(from.key_points), to.key_points, matches);
  }
  return matches;
}

}  // namespace camvox::features
