#include "camvox/recording/lockstep_gate.hpp"

#include <gmock/gmock.h>

namespace camvox::recording {
namespace {

TEST(LockstepGate, WaitsForTheSlowestComponent) {
  LockstepGate gate({"tracking", "mapping"}, 1);
  EXPECT_TRUE(gate.may_send());
  gate.sent(100);
  EXPECT_FALSE(gate.may_send());
  gate.done("tracking", 100, 1);
  EXPECT_FALSE(gate.may_send());
  gate.done("mapping", 100, 1);
  EXPECT_TRUE(gate.may_send());
}

TEST(LockstepGate, AFrameThatWasLeftOutDoesNotStopTheRest) {
  LockstepGate gate({"tracking"}, 2);
  gate.sent(100);
  gate.sent(200);
  EXPECT_FALSE(gate.may_send());
  gate.done("tracking", 200, 1);  // never saw 100
  EXPECT_TRUE(gate.may_send());
}

/// Sync tells of an image that makes no frame; the others never hear of it.
TEST(LockstepGate, LeftOutImagesInARowHoldNothingUp) {
  LockstepGate gate({"sync", "tracking"}, 2);
  gate.sent(100);
  gate.sent(200);
  EXPECT_FALSE(gate.may_send());
  gate.done("sync", 100, 0);
  gate.done("sync", 200, 0);
  EXPECT_TRUE(gate.may_send());
  gate.sent(300);
  gate.sent(400);
  EXPECT_FALSE(gate.may_send());
}

TEST(LockstepGate, ALeftOutImageDoesNotFinishTheOnesBeforeIt) {
  LockstepGate gate({"sync"}, 2);
  gate.sent(100);
  gate.sent(200);
  gate.done("sync", 200, 0);
  EXPECT_TRUE(gate.may_send());
  gate.sent(300);
  EXPECT_FALSE(gate.may_send()) << "the first still waits for its scan";
  gate.done("sync", 100, 1);
  EXPECT_TRUE(gate.may_send());
}

/// Half the time that the camera takes for its rows lies between a stamp and the report.
TEST(LockstepGate, AReportMayBeALittleLaterThanTheStamp) {
  LockstepGate gate({"sync", "tracking"}, 3);
  for (const std::int64_t stamp_ns : {100, 200, 300}) gate.sent(stamp_ns);
  gate.done("sync", 215, 0);
  EXPECT_TRUE(gate.may_send());
  gate.sent(400);
  gate.done("sync", 315, 0);
  EXPECT_TRUE(gate.may_send());
  gate.sent(500);
  EXPECT_FALSE(gate.may_send()) << "100, 400 and 500 are under way";
}

/// Sync says nothing about an image that comes twice, and a recording may hold each image raw and
/// compressed.
TEST(LockstepGate, AnImageSentTwiceCountsOnce) {
  LockstepGate gate({"sync"}, 1);
  gate.sent(100);
  gate.done("sync", 100, 1);
  gate.sent(100);
  EXPECT_TRUE(gate.may_send());
}

TEST(LockstepGate, IgnoresStrangersAndOldReports) {
  LockstepGate gate({"tracking"}, 1);
  gate.sent(100);
  gate.done("viewer", 100, 1);
  gate.done("tracking", 50, 1);
  EXPECT_FALSE(gate.may_send());
}

TEST(LockstepGate, BehindIsWhoLacksTheNewestFrameOfAnother) {
  LockstepGate gate({"sync", "tracking", "mapping"}, 3);
  for (const std::int64_t stamp_ns : {100, 200, 300}) gate.sent(stamp_ns);
  EXPECT_TRUE(gate.behind().empty());
  gate.done("sync", 100, 1);
  gate.done("sync", 200, 2);
  gate.done("tracking", 100, 1);
  EXPECT_THAT(gate.behind(), ::testing::ElementsAre("mapping", "tracking"));
  gate.done("tracking", 200, 2);
  gate.done("mapping", 200, 2);
  EXPECT_TRUE(gate.behind().empty()) << "sync itself waits for the rest of the third frame";
  gate.done("sync", 900, 0);  // left out: the others never hear of it
  EXPECT_TRUE(gate.behind().empty());
}

TEST(LockstepGate, WithoutComponentsNothingIsHeld) {
  LockstepGate gate({}, 1);
  for (int i = 0; i < 10; ++i) gate.sent(i);
  EXPECT_TRUE(gate.may_send());
}

}  // namespace
}  // namespace camvox::recording
