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
