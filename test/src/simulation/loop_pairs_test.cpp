#include "camvox/simulation/loop_pairs.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <numbers>

#include "camvox/simulation/route.hpp"

namespace camvox::simulation {
namespace {

TEST(LoopPairs, StraightLineHasNone) {
  Route route;
  route.legs = {Drive{{{80, 0}}, 1.0}};
  EXPECT_TRUE(loop_pairs(plan_route(route, {}), 10.0).empty());
  route.legs = {Pause{60.0}};
  EXPECT_TRUE(loop_pairs(plan_route(route, {}), 10.0).empty());
}

TEST(LoopPairs, ThereAndBackIsOppositeRoundAndRoundIsTheSame) {
  Route route;
  route.legs = {Drive{{{60, 0}}, 1.0}, Drive{{{0, 0}}, 1.0}};
  const auto back = loop_pairs(plan_route(route, {}), 10.0);
  ASSERT_GT(back.size(), 200u);
  for (const LoopPair& pair : back) {
    EXPECT_NEAR(pair.heading_difference_rad, std::numbers::pi, 0.2);
    EXPECT_LT(pair.earlier_frame, pair.later_frame);
    EXPECT_LE(pair.distance_m, 3.0);
  }
  route.legs = {Drive{{{20, 0}, {20, 20}, {0, 20}, {0, 0}, {20, 0}}, 2.0}};
  const auto round = loop_pairs(plan_route(route, {}), 10.0);
  ASSERT_FALSE(round.empty());
  // Away from the corners, that is for most of the second visit, the headings agree.
  const auto agree = std::count_if(round.begin(), round.end(), [](const LoopPair& pair) {
    return pair.heading_difference_rad < 0.2;
  });
  EXPECT_GT(agree, static_cast<std::ptrdiff_t>(round.size() / 2));
}

}  // namespace
}  // namespace camvox::simulation
