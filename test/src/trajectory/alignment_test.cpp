#include "camvox/trajectory/alignment.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace camvox::trajectory {
namespace {

/// A curve in space, and the same seen from elsewhere at another scale.
std::vector<PosePair> curve(const geometry::SE3& T_reference_estimate, double scale) {
  std::vector<PosePair> pairs;
  for (int i = 0; i < 50; ++i) {
    const double t = 0.1 * i;
    const geometry::SE3 estimate(geometry::SO3::exp({0.0, 0.1 * t, t}),
                                 {std::sin(t), std::cos(2.0 * t), 0.3 * t});
    const geometry::SE3 scaled(estimate.rotation(), scale * estimate.translation());
    pairs.push_back({{i, T_reference_estimate * scaled}, {i, estimate}});
  }
  return pairs;
}

geometry::SE3 some_transform() {
  geometry::Vector6d xi;
  xi << 1.0, -2.0, 0.5, 10.0, -20.0, 3.0;
  return geometry::SE3::exp(xi);
}

TEST(Align, FindsTheTransformAndTheScale) {
  const auto T = some_transform();
  const auto found = align(curve(T, 1.25), Alignment::kSim3);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->scale, 1.25, 1e-10);
  EXPECT_LT(geometry::local(T, found->T_reference_estimate).norm(), 1e-9);
  const auto moved = transformed(*found, curve(T, 1.25));
  for (const auto& [reference, estimate] : moved) {
    EXPECT_LT(geometry::local(reference.T_world_body, estimate.T_world_body).norm(), 1e-9);
  }
}

TEST(Align, RigidLeavesTheScaleAlone) {
  const auto found = align(curve(some_transform(), 1.0), Alignment::kSE3);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->scale, 1.0, 1e-12);
  EXPECT_LT(geometry::local(some_transform(), found->T_reference_estimate).norm(), 1e-9);
}

TEST(Align, OriginMakesTheFirstPosesEqual) {
  auto pairs = curve(some_transform(), 1.0);
  const auto moved = transformed(*align(pairs, Alignment::kOrigin), pairs);
  EXPECT_LT(geometry::local(moved[0].reference.T_world_body, moved[0].estimate.T_world_body).norm(),
            1e-12);
}

TEST(Align, NothingWhereTheRotationIsNotDetermined) {
  std::vector<PosePair> line;
  EXPECT_FALSE(align(line, Alignment::kSE3));
  EXPECT_FALSE(align(line, Alignment::kOrigin));
  EXPECT_TRUE(align(line, Alignment::kNone));
  for (int i = 0; i < 10; ++i) {
    const geometry::SE3 T(geometry::SO3(), {1.0 * i, 2.0 * i, 0.0});
    line.push_back({{i, T}, {i, T}});
  }
  EXPECT_FALSE(align(line, Alignment::kSE3));
  EXPECT_FALSE(align({line[0], line[1]}, Alignment::kSim3));
}

TEST(Align, NamesAreThoseOfTheCommandLine) {
  EXPECT_EQ(parse_alignment("sim3"), Alignment::kSim3);
  EXPECT_EQ(parse_alignment("origin"), Alignment::kOrigin);
  EXPECT_FALSE(parse_alignment("SE(3)"));
}

}  // namespace
}  // namespace camvox::trajectory
