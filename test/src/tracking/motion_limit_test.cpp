#include "camvox/tracking/motion_limit.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace camvox::tracking {
namespace {

using geometry::SE3;
using geometry::SO3;

constexpr double kPi = 3.14159265358979;

SE3 ahead(double z_m) { return {SO3(), {0.0, 0.0, z_m}}; }

TEST(MotionLimit, AllowsAllUntilTheVelocityIsKnown) {
  MotionLimit limit(6.0);
  EXPECT_TRUE(limit.allows(ahead(100.0), 0.1, 0.01));
  limit.observe(ahead(0.1), 0.1);
  EXPECT_FALSE(limit.allows(ahead(100.0), 0.1, 0.01));
  limit.forget();
  EXPECT_TRUE(limit.allows(ahead(100.0), 0.1, 0.01));
}

TEST(MotionLimit, NoLimitAllowsAll) {
  MotionLimit limit(0.0);
  limit.observe(ahead(0.1), 0.1);
  EXPECT_TRUE(limit.allows(ahead(100.0), 0.1, 0.01));
}

// Positions at constant acceleration in closed form, with gaps of any length: all that is slower
// than the limit is allowed, what takes much more is not.
TEST(MotionLimit, TellsAccelerationsApart) {
  for (const double over_s : {0.03, 0.1, 0.2}) {
    for (const double dt_s : {0.1, 0.2, 0.5, 1.0}) {
      const auto position_m = [](double a_mps2, double t_s) {
        return 4.0 * t_s + 0.5 * a_mps2 * t_s * t_s;
      };
      const auto allowed = [&](double a_mps2) {
        MotionLimit limit(6.0);
        limit.observe(ahead(position_m(a_mps2, over_s)), over_s);
        const double further_m = position_m(a_mps2, over_s + dt_s) - position_m(a_mps2, over_s);
        return limit.allows(ahead(further_m), dt_s, 0.0);
      };
      for (const double a_mps2 : {-5.9, -3.0, 0.0, 3.0, 5.9}) {
        EXPECT_TRUE(allowed(a_mps2)) << a_mps2 << " m/s^2, " << over_s << " s, " << dt_s << " s";
      }
      // The noise allowed for weighs in short intervals.
      const double noise_m = 0.03 * (1.0 + dt_s / over_s);
      const double much = 6.1 + noise_m / (0.5 * dt_s * (over_s + dt_s));
      EXPECT_FALSE(allowed(much)) << over_s << " s, " << dt_s << " s";
      EXPECT_FALSE(allowed(-much)) << over_s << " s, " << dt_s << " s";
    }
  }
}

// A circle of 5 m radius at 5 m/s takes 5 m/s^2: the velocity turns along with the camera.
TEST(MotionLimit, AllowsCurves) {
  constexpr double kAngle_rad = 0.1;  // in 0.1 s
  const SE3 turn(SO3::exp({0.0, kAngle_rad, 0.0}),
                 {5.0 * (1.0 - std::cos(kAngle_rad)), 0.0, 5.0 * std::sin(kAngle_rad)});
  MotionLimit limit(6.0);
  limit.observe(turn, 0.1);
  EXPECT_TRUE(limit.allows(turn, 0.1, 0.0));
  // Sideways at once is not to be had.
  EXPECT_FALSE(limit.allows({SO3::exp({0.0, kPi / 2.0, 0.0}), {0.5, 0.0, 0.0}}, 0.1, 0.0));
}

TEST(MotionLimit, LeavesRoomForThePosesOwnError) {
  MotionLimit limit(6.0);
  limit.observe(ahead(0.5), 0.1);
  EXPECT_FALSE(limit.allows(ahead(1.0), 0.1, 0.0));
  EXPECT_TRUE(limit.allows(ahead(1.0), 0.1, 0.1));
}

TEST(MotionLimit, TimeMustGoOn) {
  MotionLimit limit(6.0);
  EXPECT_THROW(limit.observe(ahead(0.1), 0.0), std::logic_error);
}

}  // namespace
}  // namespace camvox::tracking
