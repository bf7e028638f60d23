#include "camvox/tracking/keyframe_decision.hpp"

#include <gtest/gtest.h>

namespace camvox::tracking {
namespace {

/// A camera that has moved on and sees half of what it saw.
KeyframeCues due() {
  KeyframeCues cues;
  cues.inliers = 200;
  cues.reference_inliers = 400;
  cues.tracked_close = 150;
  cues.untracked_close = 100;
  cues.keyframes = 5;
  cues.since_last_s = 0.3;
  cues.baseline_ratio = 0.05;
  return cues;
}

const KeyframeConfig kConfig;

TEST(KeyframeDecisionTest, IsDueWhenMuchIsOutOfSight) {
  KeyframeCues cues = due();
  EXPECT_TRUE(is_keyframe(cues, kConfig));
  cues.inliers = 310;  // more than 75 %
  EXPECT_FALSE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, FirstKeyframeLastsLonger) {
  KeyframeCues cues = due();
  cues.keyframes = 1;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
  cues.inliers = 150;
  EXPECT_TRUE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, StandstillMakesNone) {
  KeyframeCues cues = due();
  cues.baseline_ratio = 0.001;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
  cues.rotation_rad = 0.1;
  EXPECT_TRUE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, ClosePointsAreNeeded) {
  KeyframeCues cues = due();
  cues.inliers = 390;
  cues.tracked_close = 99;
  cues.untracked_close = 71;
  EXPECT_TRUE(is_keyframe(cues, kConfig));
  cues.untracked_close = 70;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, BusyMappingGetsOnlyWhatIsUrgent) {
  KeyframeCues cues = due();
  cues.pending_keyframes = 1;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
  cues.since_last_s = 1.0;
  EXPECT_TRUE(is_keyframe(cues, kConfig));
  cues.since_last_s = 0.3;
  cues.inliers = 90;  // below a quarter
  EXPECT_TRUE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, WithManyPendingOnlyAWeakFrame) {
  KeyframeCues cues = due();
  cues.pending_keyframes = 3;
  cues.since_last_s = 1.0;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
  cues.inliers = 90;  // below a quarter: the next frame may see nothing that is known
  EXPECT_TRUE(is_keyframe(cues, kConfig));
}

TEST(KeyframeDecisionTest, WhereMappingIsAwayItIsNotWaitedFor) {
  KeyframeCues cues = due();
  cues.pending_keyframes = 30;
  cues.since_last_s = 1.0;
  cues.since_map_s = 1.9;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
  cues.since_map_s = 2.0;
  EXPECT_TRUE(is_keyframe(cues, kConfig));
  cues.since_last_s = 0.3;
  EXPECT_FALSE(is_keyframe(cues, kConfig)) << "no more of them than of a busy mapping";
}

TEST(KeyframeDecisionTest, NeverWithNextToNothing) {
  KeyframeCues cues = due();
  cues.inliers = 15;
  EXPECT_FALSE(is_keyframe(cues, kConfig));
}

}  // namespace
}  // namespace camvox::tracking
