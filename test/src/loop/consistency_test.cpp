#include "camvox/loop/consistency.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <random>

namespace camvox::loop {
namespace {

using geometry::SE3;

/// Size of the largest clique by trying all sets.
std::size_t brute_force_clique(const std::vector<std::vector<bool>>& adjacent) {
  std::size_t best = 0;
  for (std::uint32_t set = 0; set < (1U << adjacent.size()); ++set) {
    bool clique = true;
    for (std::size_t i = 0; i < adjacent.size() && clique; ++i) {
      for (std::size_t j = 0; j < i && clique; ++j) {
        clique = ((set >> i) & 1U) == 0 || ((set >> j) & 1U) == 0 || adjacent[i][j];
      }
    }
    if (clique) best = std::max<std::size_t>(best, static_cast<std::size_t>(std::popcount(set)));
  }
  return best;
}

TEST(MaximumCliqueTest, AgreesWithBruteForce) {
  std::mt19937 random(1);
  for (int round = 0; round < 60; ++round) {
    const std::size_t size = 1 + random() % 11;
    const auto density = 1 + random() % 9;
    std::vector<std::vector<bool>> adjacent(size, std::vector<bool>(size, false));
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < i; ++j) adjacent[i][j] = adjacent[j][i] = random() % 10 < density;
    }
    const auto clique = maximum_clique(adjacent);
    EXPECT_EQ(clique.size(), brute_force_clique(adjacent));
    for (const auto a : clique) {
      for (const auto b : clique) EXPECT_TRUE(a == b || adjacent[a][b]);
    }
  }
  EXPECT_TRUE(maximum_clique({}).empty());
}

TEST(MaximumCliqueTest, StopsInTime) {
  std::mt19937 random(2);
  std::vector<std::vector<bool>> adjacent(300, std::vector<bool>(300, false));
  for (std::size_t i = 0; i < 300; ++i) {
    for (std::size_t j = 0; j < i; ++j) adjacent[i][j] = adjacent[j][i] = random() % 10 < 8;
  }
  EXPECT_GT(maximum_clique(adjacent, 2000).size(), 15U);
}

/// Two loops between keyframes 1 m apart, both right unless told otherwise.
struct Loops {
  Loops() {
    const SE3 T_match_query(geometry::SO3::exp({0.0, 0.2, 0.0}), {0.3, 0.0, 1.0});
    a = {101, 1, T_match_query, 1e-6 * geometry::Matrix6d::Identity(), 100};
    b = a;
    b.query_id = 102;
    b.match_id = 2;
    b.T_match_query = step.inverse() * T_match_query * step;
    pair.a = &a;
    pair.b = &b;
    pair.T_query_a_query_b = step;
    pair.T_match_a_match_b = step;
    pair.query_path_m = pair.match_path_m = 1.0;
  }
  SE3 step{geometry::SO3::exp({0.0, 0.02, 0.0}), {0.0, 0.0, 1.0}};
  LoopMeasurement a, b;
  LoopPair pair;
  DriftConfig config;
};

TEST(ConsistencyTest, RightLoopsAgree) {
  Loops loops;
  EXPECT_TRUE(consistent(loops.pair, loops.config));
  loops.b.T_match_query = loops.b.T_match_query * SE3({}, {0.05, 0.0, 0.0});
  EXPECT_TRUE(consistent(loops.pair, loops.config));
}

TEST(ConsistencyTest, AWrongOneDisagrees) {
  Loops loops;
  loops.b.T_match_query = loops.b.T_match_query * SE3({}, {1.0, 0.0, 0.0});
  EXPECT_FALSE(consistent(loops.pair, loops.config));
  Loops turned;
  turned.b.T_match_query =
      turned.b.T_match_query * SE3(geometry::SO3::exp({0.0, 0.1, 0.0}), {0, 0, 0});
  EXPECT_FALSE(consistent(turned.pair, turned.config));
}

// Over a long way the map can be as wrong as that.
TEST(ConsistencyTest, DriftExcusesDistantLoops) {
  Loops loops;
  loops.b.T_match_query = loops.b.T_match_query * SE3({}, {1.0, 0.0, 0.0});
  loops.pair.match_path_m = 100.0;
  EXPECT_TRUE(consistent(loops.pair, loops.config));
}

TEST(ConsistencyTest, PlausibleWithinDrift) {
  Loops loops;
  const SE3 T_in_map = loops.a.T_match_query * SE3({}, {2.0, 0.0, 0.0});
  EXPECT_TRUE(plausible(loops.a, T_in_map, 100.0, loops.config));
  EXPECT_FALSE(plausible(loops.a, T_in_map, 10.0, loops.config));
}

}  // namespace
}  // namespace camvox::loop
