#include "camvox/lidar/force_unit.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace camvox::lidar {
namespace {

ForceUnit after(double norm, int samples = 100) {
  ForceUnit unit;
  for (int i = 0; i < samples; ++i) unit.add(norm * (1.0 + 0.3 * std::sin(i)));
  return unit;
}

TEST(ForceUnit, TellsMetresFromG) {
  EXPECT_EQ(after(9.81).factor_m_s2(), 1.0);
  EXPECT_EQ(after(1.0).factor_m_s2(), 9.80665);
}

TEST(ForceUnit, WaitsForEnoughSamples) { EXPECT_EQ(after(9.81, 10).factor_m_s2(), std::nullopt); }

TEST(ForceUnit, SaysWhenItIsNeither) {
  EXPECT_EQ(after(0.01).factor_m_s2(), std::nullopt);
  EXPECT_TRUE(after(0.01).implausible());
  EXPECT_TRUE(after(100.0).implausible());
  EXPECT_FALSE(after(9.81).implausible());
}

TEST(ForceUnit, IgnoresWhatIsNoNumber) {
  ForceUnit unit;
  for (int i = 0; i < 100; ++i)
    unit.add(i % 2 == 0 ? 9.8 : std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(unit.factor_m_s2(), 1.0);
}

}  // namespace
}  // namespace camvox::lidar
