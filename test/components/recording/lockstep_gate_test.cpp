#include "camvox/recording/lockstep_gate.hpp"

#include <gtest/gtest.h>

namespace camvox::recording {
namespace {

TEST(LockstepGate, WaitsForTheSlowestComponent) {
  LockstepGate gate({"tracking", "mapping"}, 1);
  EXPECT_TRUE(gate.may_send());
  gate.sent(100);
  EXPECT_FALSE(gate.may_send());
  gate.done("tracking", 100);
  EXPECT_FALSE(gate.may_send());
  gate.done("mapping", 100);
  EXPECT_TRUE(gate.may_send());
}

TEST(LockstepGate, AFrameThatWasLeftOutDoesNotStopTheRest) {
  LockstepGate gate({"tracking"}, 2);
  gate.sent(100);
  gate.sent(200);
  EXPECT_FALSE(gate.may_send());
  gate.done("tracking", 200);  // never saw 100
  EXPECT_TRUE(gate.may_send());
}

TEST(LockstepGate, IgnoresStrangersAndOldReports) {
  LockstepGate gate({"tracking"}, 1);
  gate.sent(100);
  gate.done("viewer", 100);
  gate.done("tracking", 50);
  EXPECT_FALSE(gate.may_send());
}

TEST(LockstepGate, WithoutComponentsNothingIsHeld) {
  LockstepGate gate({}, 1);
  for (int i = 0; i < 10; ++i) gate.sent(i);
  EXPECT_TRUE(gate.may_send());
}

}  // namespace
}  // namespace camvox::recording
