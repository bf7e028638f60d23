#include "camvox/sync/stamp_guard.hpp"

#include <gtest/gtest.h>

namespace camvox::sync {
namespace {

TEST(StampGuard, TellsOrderDuplicatesAndDelays) {
  StampGuard guard(1000);
  EXPECT_EQ(guard.judge(10'000), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(10'100), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(10'100), StampVerdict::kDuplicate);
  EXPECT_EQ(guard.judge(10'050), StampVerdict::kEarlier);
  EXPECT_EQ(guard.judge(11'100), StampVerdict::kNext);
  EXPECT_EQ(guard.newest_ns(), 11'100);
}

TEST(StampGuard, OneStrayStampIsAGlitch) {
  StampGuard guard(1000);
  EXPECT_EQ(guard.judge(10'000), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(90'000), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(10'100), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(0), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(10'200), StampVerdict::kNext);
  EXPECT_EQ(guard.newest_ns(), 10'200);
}

TEST(StampGuard, TwoInARowAreAnotherClock) {
  StampGuard guard(1000);
  EXPECT_EQ(guard.judge(10'000), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(100), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(200), StampVerdict::kJump);
  EXPECT_EQ(guard.newest_ns(), 200);
  EXPECT_EQ(guard.judge(300), StampVerdict::kNext);
}

TEST(StampGuard, StrayStampsThatDoNotAgreeAreNoClock) {
  StampGuard guard(1000);
  EXPECT_EQ(guard.judge(10'000), StampVerdict::kNext);
  EXPECT_EQ(guard.judge(90'000), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(50'000), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(49'900), StampVerdict::kSuspect);
  EXPECT_EQ(guard.judge(49'900), StampVerdict::kSuspect);
}

}  // namespace
}  // namespace camvox::sync
