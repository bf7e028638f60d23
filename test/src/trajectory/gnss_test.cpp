#include "camvox/trajectory/gnss.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace camvox::trajectory {
namespace {

// WGS 84 at the equator: one degree of longitude is a pi / 180, of latitude a (1 - e^2) pi / 180.
TEST(Gnss, SmallStepsOnTheEquatorAreClosedForm) {
  constexpr double kA_m = 6378137.0;
  constexpr double kE2 = 0.00669437999014;
  const double step_deg = 1e-4;  // 11 m; the tangent plane is off by d^2 / 2a = 1e-5 m
  const auto path = to_enu({{0, 0.0, 10.0, 5.0},
                            {1, 0.0, 10.0 + step_deg, 5.0},
                            {2, step_deg, 10.0, 5.0},
                            {3, 0.0, 10.0, 7.5}});
  ASSERT_EQ(path.size(), 4U);
  EXPECT_LT(path[0].T_world_body.translation().norm(), 1e-9);
  const double step_rad = step_deg * M_PI / 180.0;
  EXPECT_NEAR(path[1].T_world_body.translation().x(), (kA_m + 5.0) * step_rad, 1e-4);
  EXPECT_NEAR(path[2].T_world_body.translation().y(), (kA_m * (1.0 - kE2) + 5.0) * step_rad, 1e-4);
  EXPECT_NEAR(path[3].T_world_body.translation().z(), 2.5, 1e-6);
}

TEST(Gnss, LeavesOutWhatIsNoPlaceOrNotLater) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto path = to_enu({{0, nan, 0.0, 0.0},
                            {1, 91.0, 0.0, 0.0},
                            {2, 1.0, 2.0, 3.0},
                            {2, 1.0, 2.0, 3.0},
                            {3, 1.0, 2.0, nan},
                            {4, 1.0, 2.0, 4.0}});
  ASSERT_EQ(path.size(), 2U);
  EXPECT_EQ(path[1].stamp_ns, 4);
  EXPECT_TRUE(to_enu({}).empty());
}

}  // namespace
}  // namespace camvox::trajectory
