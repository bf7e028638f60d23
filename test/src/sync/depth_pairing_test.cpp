#include "camvox/sync/depth_pairing.hpp"

#include <gtest/gtest.h>

namespace camvox::sync {
namespace {

void add(DepthPairing<int>& pairing, std::int64_t stamp, int payload) {
  if (pairing.accepts(stamp)) pairing.add(stamp, payload);
}

TEST(DepthPairing, TakesTheNearestOnce) {
  DepthPairing<int> pairing(20, 1000, 8);
  add(pairing, 100, 1);
  add(pairing, 133, 2);
  add(pairing, 166, 3);
  EXPECT_EQ(pairing.take(130), 2);
  EXPECT_EQ(pairing.take(150), 3);
  EXPECT_EQ(pairing.take(170), std::nullopt);
}

TEST(DepthPairing, RefusesWhatIsTooFar) {
  DepthPairing<int> pairing(20, 1000, 8);
  add(pairing, 100, 1);
  EXPECT_EQ(pairing.take(130), std::nullopt);
  EXPECT_EQ(pairing.take(119), 1);  // it was not for the other image
}

TEST(DepthPairing, IsDecidedOnceALaterOneIsKnown) {
  DepthPairing<int> pairing(20, 1000, 8);
  EXPECT_FALSE(pairing.decided(100));
  add(pairing, 90, 1);
  EXPECT_FALSE(pairing.decided(100));
  add(pairing, 100, 2);
  EXPECT_TRUE(pairing.decided(100));
}

TEST(DepthPairing, IsBoundedAndCounts) {
  DepthPairing<int> pairing(20, 1000, 2);
  for (int i = 0; i < 10; ++i) add(pairing, 100 * i, i);
  add(pairing, 900, 9);
  add(pairing, 850, 9);
  EXPECT_EQ(pairing.take(700), std::nullopt);
  EXPECT_EQ(pairing.take(800), 8);
  EXPECT_EQ(pairing.counters().duplicates, 1U);
  EXPECT_EQ(pairing.counters().late, 1U);
}

}  // namespace
}  // namespace camvox::sync
