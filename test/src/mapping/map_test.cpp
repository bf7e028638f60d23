#include "camvox/mapping/map.hpp"

#include <gtest/gtest.h>

#include <ctime>

namespace camvox::mapping {
namespace {

double processor_time_s() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// Each keyframe hangs below the one before.
Map chain(KeyframeId count) {
  Map map;
  for (KeyframeId id = 1; id <= count; ++id) {
    tracking::Keyframe keyframe;
    keyframe.id = id;
    map.add_keyframe(keyframe, id - 1);
  }
  return map;
}

TEST(MapTest, ParentsComeFirst) {
  Map map = chain(3);
  map.set_parent(3, 1);
  map.check_consistency();
  EXPECT_EQ(map.parents_first(), (std::vector<KeyframeId>{1, 2, 3}));
  map.remove_keyframe(2);
  map.check_consistency();
  EXPECT_EQ(map.parents_first(), (std::vector<KeyframeId>{1, 3}));
  EXPECT_TRUE(Map().parents_first().empty());
  Map().check_consistency();
}

double time_of_check_s(const Map& map) {
  const double before_s = processor_time_s();
  map.check_consistency();
  return processor_time_s() - before_s;
}

// Loading ends with it. A walk to the root from each keyframe of a chain took a thousand times as
// long as where all hang below the first.
TEST(MapTest, ALongChainIsCheckedInOnePass) {
  Map star;
  for (KeyframeId id = 1; id <= 12000; ++id) {
    tracking::Keyframe keyframe;
    keyframe.id = id;
    star.add_keyframe(keyframe, id == 1 ? 0 : 1);
  }
  EXPECT_LT(time_of_check_s(chain(12000)), 100.0 * time_of_check_s(star));
}

}  // namespace
}  // namespace camvox::mapping
