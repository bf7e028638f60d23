#include "camvox/conversion/pose.hpp"

#include <gtest/gtest.h>

namespace camvox::conversion {
namespace {

TEST(PoseConversionTest, ReadsWhatItWrote) {
  geometry::Vector6d xi;
  xi << 0.1, -0.7, 1.2, 3.0, -4.0, 5.0;
  const auto T = geometry::SE3::exp(xi);
  EXPECT_LT(geometry::local(T, to_se3(to_array(T))).norm(), 1e-12);
}

TEST(PoseConversionTest, OrderIsTranslationThenQuaternionXyzw) {
  const geometry::SE3 T(geometry::SO3::exp({0.0, 0.0, 1.0}), {1.0, 2.0, 3.0});
  const auto array = to_array(T);
  EXPECT_EQ(array[1], 2.0);
  EXPECT_NEAR(array[5], std::sin(0.5), 1e-12);
  EXPECT_NEAR(array[6], std::cos(0.5), 1e-12);
}

TEST(PoseConversionTest, RefusesAPoseThatNobodyFilled) {
  EXPECT_THROW((void)to_se3(PoseArray{}), std::logic_error);
}

TEST(PoseConversionTest, CovarianceIsRowMajor) {
  geometry::Matrix6d covariance = geometry::Matrix6d::Zero();
  covariance(1, 2) = 5.0;
  const auto array = to_array(covariance);
  EXPECT_EQ(array[8], 5.0);
  EXPECT_EQ(to_matrix(array), covariance);
}

}  // namespace
}  // namespace camvox::conversion
