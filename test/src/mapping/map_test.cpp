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

// Loading ends with it: one look at each keyframe takes milliseconds, a walk to the root from each
// took 7 s.
TEST(MapTest, ALongChainIsCheckedInOnePass) {
  const Map map = chain(12000);
  const double before_s = processor_time_s();
  map.check_consistency();
  EXPECT_LT(processor_time_s() - before_s, 1.0);
}

}  // namespace
}  // namespace camvox::mapping
