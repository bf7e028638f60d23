#include "camvox/tracking/motion_model.hpp"

#include <gtest/gtest.h>

namespace camvox::tracking {
namespace {

using geometry::SE3;
using geometry::SO3;

TEST(MotionModelTest, StandsWhileNothingIsKnown) {
  const MotionModel model;
  EXPECT_FALSE(model.is_known());
  EXPECT_LT(model.predict(0.1).log().norm(), 1e-15);
}

TEST(MotionModelTest, ScalesWithTime) {
  MotionModel model;
  geometry::Vector6d twist;
  twist << 0.1, -0.2, 0.3, 1.0, 2.0, -3.0;
  model.observe(SE3::exp(twist * 0.1), 0.1);
  EXPECT_LT((model.twist_camera() - twist).norm(), 1e-9);
  EXPECT_LT(geometry::local(model.predict(0.25), SE3::exp(twist * 0.25)).norm(), 1e-9);
  model.reset();
  EXPECT_FALSE(model.is_known());
}

TEST(MotionModelTest, GyroGivesTheRotation) {
  MotionModel model;
  model.observe(SE3(SO3::exp({0.0, 0.1, 0.0}), {0.0, 0.0, 0.5}), 0.1);
  const SO3 R = SO3::exp({0.0, -0.3, 0.0});
  const SE3 predicted = model.predict(0.1, R);
  EXPECT_LT((predicted.rotation().inverse() * R).angle_rad(), 1e-12);
  EXPECT_NEAR(predicted.translation().z(), 0.5, 1e-9);
}

TEST(MotionModelTest, TimeMustGoOn) {
  MotionModel model;
  EXPECT_THROW(model.observe(SE3(), 0.0), std::logic_error);
}

}  // namespace
}  // namespace camvox::tracking
