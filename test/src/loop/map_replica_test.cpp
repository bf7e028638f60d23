#include "camvox/loop/map_replica.hpp"

#include <gmock/gmock.h>

namespace camvox::loop {
namespace {

using geometry::SE3;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Keyframes 1 to 5, one metre apart, each the parent of the next.
MapReplica line_of_five() {
  MapReplica map;
  for (std::uint64_t id = 1; id <= 5; ++id) {
    tracking::Keyframe keyframe;
    keyframe.id = id;
    keyframe.parent_id = id - 1;
    keyframe.T_map_camera = SE3({}, {0.0, 0.0, static_cast<double>(id)});
    map.insert(keyframe);
  }
  return map;
}

TEST(MapReplicaTest, PathsFollowParentsLandmarksAndLoops) {
  auto map = line_of_five();
  EXPECT_EQ(map.path_lengths(1, 10.0, {}).at(5), 4.0);
  EXPECT_FALSE(map.path_lengths(1, 3.5, {}).contains(5));
  EXPECT_EQ(map.path_lengths(1, 10.0, {{4, 1}}).at(5), 1.0);
  map.apply({.map_epoch = 0, .T_map_camera = {}, .removed = {}, .edges = {{1, 5, 20}, {1, 4, 3}}});
  EXPECT_EQ(map.path_lengths(1, 10.0, {}).at(5), 4.0);  // as far, but known directly
  EXPECT_THAT(map.neighbours(1, 9), ElementsAre(5, 2));
  EXPECT_THAT(map.path_lengths(99, 10.0, {}), IsEmpty());
}

TEST(MapReplicaTest, TakesChangesOver) {
  auto map = line_of_five();
  map.apply({.map_epoch = 3,
             .T_map_camera = {{2, SE3({}, {7.0, 0.0, 0.0})}, {99, SE3()}},
             .removed = {},
             .edges = {}});
  EXPECT_EQ(map.map_epoch(), 3U);
  EXPECT_EQ(map.find(2)->T_map_camera.translation().x(), 7.0);
  EXPECT_EQ(map.find(99), nullptr);
}

TEST(MapReplicaTest, ChildrenOfARemovedOneGoToItsParent) {
  auto map = line_of_five();
  map.apply({.map_epoch = 0, .T_map_camera = {}, .removed = {3}, .edges = {{2, 3, 50}}});
  EXPECT_EQ(map.find(3), nullptr);
  EXPECT_EQ(map.find(4)->parent, 2U);
  EXPECT_THAT(map.neighbours(2, 9), ElementsAre(1, 4));
  map.apply({.map_epoch = 0, .T_map_camera = {}, .removed = {1, 77}, .edges = {}});
  EXPECT_EQ(map.find(2)->parent, 0U);
}

TEST(MapReplicaTest, AnotherStandsInForAParentThatIsNotHereYet) {
  MapReplica map;
  const auto insert = [&map](KeyframeId id, KeyframeId parent_id) {
    tracking::Keyframe keyframe;
    keyframe.id = id;
    keyframe.parent_id = parent_id;
    map.insert(keyframe);
  };
  insert(4, 2);
  EXPECT_EQ(map.find(4)->parent, 0U);
  insert(3, 1);
  EXPECT_EQ(map.find(4)->parent, 3U);
  insert(2, 1);
  EXPECT_EQ(map.find(4)->parent, 2U);
  EXPECT_EQ(map.find(3)->parent, 2U);
  EXPECT_EQ(map.find(2)->parent, 0U);
  insert(1, 1);  // the first one names itself
  EXPECT_EQ(map.find(1)->parent, 0U);
  EXPECT_THAT(map.find(1)->children, ::testing::UnorderedElementsAre(2, 3));
  EXPECT_THAT(map.find(2)->children, ElementsAre(4));
  EXPECT_THAT(map.find(3)->children, IsEmpty());
  insert(4, 3);  // sent again
  EXPECT_EQ(map.find(4)->parent, 2U);
  insert(5, 7);  // a parent that is younger than its child is none
  EXPECT_EQ(map.find(5)->parent, 4U);
}

}  // namespace
}  // namespace camvox::loop
