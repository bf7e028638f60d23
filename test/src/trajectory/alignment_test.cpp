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

/// A straight drive of 20 m, nodding a little, and the same seen from elsewhere with position
/// errors of `error_m` around the line: a screw, which positions alone take for a bend.
std::vector<PosePair> drive(const geometry::SE3& T_reference_estimate, double error_m) {
  std::vector<PosePair> pairs;
  for (int i = 0; i <= 200; ++i) {
    const double t = 0.1 * i;
    const geometry::SO3 rotation = geometry::SO3::exp({0.0, 0.01 * std::sin(t), 0.3});
    const Eigen::Vector3d wave(0.0, std::sin(t), std::cos(t));
    const geometry::SE3 truth(rotation, {t, 0.01 * wave.y(), 0.0});
    const geometry::SE3 estimate(rotation,
                                 {t, error_m * wave.z(), error_m * wave.y() + 0.01 * wave.y()});
    pairs.push_back({{i, T_reference_estimate * truth}, {i, estimate}});
  }
  return pairs;
}

// The wave of 0.01 m goes sideways in the truth and up in the estimate: positions say that it is
// rolled by 90 degrees, orientations that it is not.
TEST(Align, OrientationsTellTheRollAboutAStraightPath) {
  const auto T = some_transform();
  for (const double error_m : {0.0, 0.002}) {
    const auto found = align(drive(T, error_m), Alignment::kSE3);
    ASSERT_TRUE(found.has_value());
    EXPECT_TRUE(found->on_a_line);
    // Waves of 0.012 m over 20 m tilt the line by about 0.012 / 20 rad at most.
    EXPECT_LT((T.rotation().inverse() * found->T_reference_estimate.rotation()).log().norm(), 2e-3);
  }
}

TEST(Align, OrientationsTellTheRollAboutAnExactLine) {
  std::vector<PosePair> line;
  const auto T = some_transform();
  for (int i = 0; i < 10; ++i) {
    const geometry::SE3 pose(geometry::SO3::exp({0.1 * i, 0.0, 0.2}), {1.0 * i, 2.0 * i, 0.0});
    line.push_back({{i, T * pose}, {i, pose}});
  }
  const auto found = align(line, Alignment::kSE3);
  ASSERT_TRUE(found.has_value());
  EXPECT_LT(geometry::local(T, found->T_reference_estimate).norm(), 1e-9);
  EXPECT_FALSE(align({line[0], line[1]}, Alignment::kSE3));
  EXPECT_FALSE(align(curve(T, 1.0), Alignment::kSE3)->on_a_line);
}

TEST(Align, NamesAreThoseOfTheCommandLine) {
  EXPECT_EQ(parse_alignment("sim3"), Alignment::kSim3);
  EXPECT_EQ(parse_alignment("origin"), Alignment::kOrigin);
  EXPECT_FALSE(parse_alignment("SE(3)"));
}

}  // namespace
}  // namespace camvox::trajectory
