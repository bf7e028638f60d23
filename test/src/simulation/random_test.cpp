#include "camvox/simulation/random.hpp"

#include <gmock/gmock.h>

namespace camvox::simulation {
namespace {

TEST(CounterRandom, SameCounterSameNumberWhateverTheOrder) {
  const CounterRandom a(1, 2);
  const CounterRandom b(1, 2);
  const double late = a.uniform(1000, 3);
  (void)b.uniform(5);
  EXPECT_EQ(b.uniform(1000, 3), late);
}

TEST(CounterRandom, SeedsStreamsAndChannelsAreIndependent) {
  EXPECT_NE(CounterRandom(1, 2).bits(7), CounterRandom(2, 2).bits(7));
  EXPECT_NE(CounterRandom(1, 2).bits(7), CounterRandom(1, 3).bits(7));
  EXPECT_NE(CounterRandom(1, 2).bits(7, 0), CounterRandom(1, 2).bits(7, 1));
  // Correlation of neighbouring samples, channels and streams: 200 000 pairs give a sigma of
  // 0.0022; the bound is five of them.
  const CounterRandom x(9, 1);
  const CounterRandom y(9, 2);
  double streams = 0, channels = 0, neighbours = 0;
  constexpr int kCount = 200'000;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    streams += x.normal(i) * y.normal(i) / kCount;
    channels += x.normal(i, 0) * x.normal(i, 1) / kCount;
    neighbours += x.normal(i) * x.normal(i + 1) / kCount;
  }
  EXPECT_LT(std::abs(streams), 0.011);
  EXPECT_LT(std::abs(channels), 0.011);
  EXPECT_LT(std::abs(neighbours), 0.011);
}

TEST(CounterRandom, MomentsAreThoseOfTheDistributions) {
  const CounterRandom random(3, 4);
  double uniform = 0, normal = 0, normal2 = 0, normal4 = 0, fast2 = 0, fast = 0;
  constexpr int kCount = 400'000;
  for (std::uint64_t i = 0; i < kCount; ++i) {
    const double n = random.normal(i);
    const double f = static_cast<double>(random.fast_normal(i));
    uniform += random.uniform(i) / kCount;
    normal += n / kCount;
    normal2 += n * n / kCount;
    normal4 += n * n * n * n / kCount;
    fast += f / kCount;
    fast2 += f * f / kCount;
  }
  // Standard errors: 0.0005, 0.0016, 0.0022, 0.015; bounds are five of them.
  EXPECT_NEAR(uniform, 0.5, 0.0025);
  EXPECT_NEAR(normal, 0.0, 0.008);
  EXPECT_NEAR(normal2, 1.0, 0.011);
  EXPECT_NEAR(normal4, 3.0, 0.08);
  EXPECT_NEAR(fast, 0.0, 0.008);
  EXPECT_NEAR(fast2, 1.0, 0.011);
}

}  // namespace
}  // namespace camvox::simulation
