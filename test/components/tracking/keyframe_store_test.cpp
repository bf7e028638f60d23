#include "camvox/tracking_component/keyframe_store.hpp"

#include <gmock/gmock.h>

namespace camvox::tracking_component {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Ids = std::vector<tracking::KeyframeId>;

/// Keyframe n is that of frame 10 n.
class KeyframeStoreTest : public testing::Test {
 protected:
  void add(tracking::KeyframeId first, tracking::KeyframeId last) {
    for (auto id = first; id <= last; ++id) {
      tracking::Keyframe keyframe;
      keyframe.id = id;
      keyframe.frame_id = 10 * id;
      store_.add(std::move(keyframe));
    }
  }
  [[nodiscard]] Ids missing(tracking::KeyframeId next_id,
                            std::uint64_t map_frame_id,
                            std::uint64_t frame_id) {
    Ids ids;
    for (const auto* keyframe : store_.missing(next_id, map_frame_id, frame_id)) {
      ids.push_back(keyframe->id);
    }
    return ids;
  }

  KeyframeStore store_{20};
};

TEST_F(KeyframeStoreTest, NothingIsMissingFromAMapThatHasAll) {
  EXPECT_THAT(missing(1, 5, 5), IsEmpty());
  add(1, 3);
  EXPECT_THAT(missing(4, 35, 35), IsEmpty());
}

TEST_F(KeyframeStoreTest, AKeyframeWhoseFrameMappingHasNotSeenIsNotMissing) {
  add(1, 3);
  EXPECT_THAT(missing(3, 29, 31), IsEmpty());
  EXPECT_THAT(missing(3, 30, 31), ElementsAre(3));
}

TEST_F(KeyframeStoreTest, ARestartedMappingGetsAllInBatches) {
  add(1, 20);
  EXPECT_THAT(missing(1, 203, 205), ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  EXPECT_THAT(missing(4, 204, 206), IsEmpty()) << "the rest of the batch is under way";
  EXPECT_THAT(missing(9, 205, 207), ElementsAre(9, 10, 11, 12, 13, 14, 15, 16));
  EXPECT_THAT(missing(17, 206, 208), ElementsAre(17, 18, 19, 20));
  EXPECT_THAT(missing(21, 207, 209), IsEmpty());
}

TEST_F(KeyframeStoreTest, ABatchThatDoesNotArriveIsSentOnceMore) {
  add(1, 3);
  EXPECT_THAT(missing(2, 31, 31), ElementsAre(2, 3));
  EXPECT_THAT(missing(2, 40, 50), IsEmpty());
  EXPECT_THAT(missing(2, 50, 51), ElementsAre(2, 3));
}

TEST_F(KeyframeStoreTest, TheOldestGoes) {
  add(1, 25);
  EXPECT_EQ(store_.size(), 20U);
  EXPECT_EQ(missing(1, 300, 300).front(), 6U);
}

TEST_F(KeyframeStoreTest, WhatWasTakenFromOneThatIsDroppedHangsOnItsParent) {
  for (tracking::KeyframeId id = 1; id <= 3; ++id) {
    tracking::Keyframe keyframe;
    keyframe.id = id;
    keyframe.parent_id = id - 1;
    keyframe.T_parent_camera = geometry::SE3(geometry::SO3(), {0.0, 0.0, static_cast<double>(id)});
    store_.add(std::move(keyframe));
  }
  store_.drop(2);
  store_.drop(77);  // of which there is none
  const auto left = store_.missing(1, 0, 0);
  ASSERT_EQ(left.size(), 2U);
  EXPECT_EQ(left[1]->id, 3U);
  EXPECT_EQ(left[1]->parent_id, 1U);
  EXPECT_DOUBLE_EQ(left[1]->T_parent_camera.translation().z(), 5.0);
}

TEST_F(KeyframeStoreTest, WithoutCapacityNothingIsKept) {
  KeyframeStore none(0);
  none.add({});
  EXPECT_EQ(none.size(), 0U);
}

}  // namespace
}  // namespace camvox::tracking_component
