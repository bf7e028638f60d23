#include "camvox/loop_closing/map_order.hpp"

#include <gtest/gtest.h>

namespace camvox::loop_closing {
namespace {

tracking::Keyframe keyframe(std::uint64_t id) {
  tracking::Keyframe keyframe;
  keyframe.id = id;
  keyframe.frame_id = 10 * id;
  return keyframe;
}

loop::MapChange change(const std::vector<std::uint64_t>& ids) {
  loop::MapChange change;
  for (const auto id : ids) change.T_map_camera.emplace_back(id, geometry::SE3());
  return change;
}

TEST(MapOrderTest, KeyframeAndChangeMeetInAnyOrder) {
  MapOrder order(8);
  order.add(keyframe(1));
  EXPECT_FALSE(order.next());
  order.add(change({1}), 10);
  auto step = order.next();
  ASSERT_TRUE(step);
  EXPECT_EQ(step->keyframes.at(0).id, 1U);
  order.add(change({1, 2}), 20);
  EXPECT_FALSE(order.next());
  order.add(change({1}), 21);  // of the map with keyframe 2: comes after it
  EXPECT_FALSE(order.next());
  order.add(keyframe(2));
  step = order.next();
  ASSERT_TRUE(step);
  EXPECT_EQ(step->keyframes.at(0).id, 2U);
  EXPECT_EQ(step->change.T_map_camera.size(), 2U);
  step = order.next();
  ASSERT_TRUE(step);
  EXPECT_TRUE(step->keyframes.empty());
  EXPECT_FALSE(order.next());
  EXPECT_EQ(order.waiting(), 0U);
}

TEST(MapOrderTest, ARefusedKeyframeIsNamed) {
  MapOrder order(8);
  order.add(keyframe(1));
  order.add(keyframe(2));
  order.add(change({2}), 20);
  const auto step = order.next();
  ASSERT_TRUE(step);
  EXPECT_EQ(step->keyframes.at(0).id, 2U);
  ASSERT_EQ(step->refused.size(), 1U);
  EXPECT_EQ(step->refused[0].id, 1U);
}

TEST(MapOrderTest, DoesNotWaitForWhatWasLost) {
  MapOrder order(2);
  order.add(change({1}), 10);
  order.add(change({1}), 11);
  EXPECT_FALSE(order.next());
  order.add(change({1}), 12);
  ASSERT_TRUE(order.next());
  EXPECT_EQ(order.unpaired(), 1U);
  while (order.next()) {
  }
  for (std::uint64_t id = 2; id <= 4; ++id) order.add(keyframe(id));
  const auto step = order.next();
  ASSERT_TRUE(step);
  EXPECT_EQ(step->keyframes.at(0).id, 2U);
  EXPECT_FALSE(order.next());
}

TEST(MapOrderTest, KeyframesThatComeTwiceChangeNothing) {
  MapOrder order(2);
  for (std::uint64_t id = 1; id <= 4; ++id) order.add(keyframe(id));
  order.add(change({1, 2, 3, 4}), 5);
  EXPECT_TRUE(order.next());
  for (std::uint64_t id = 1; id <= 4; ++id) order.add(keyframe(id));
  EXPECT_FALSE(order.next());
  EXPECT_EQ(order.waiting(), 0U);
}

TEST(MapOrderTest, KnowsTheKeyframesOfALoadedMap) {
  MapOrder order(8);
  order.add(change({5}), 0);
  EXPECT_FALSE(order.next());
  order.know(5);
  EXPECT_TRUE(order.next());
}

}  // namespace
}  // namespace camvox::loop_closing
