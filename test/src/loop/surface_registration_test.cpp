#include "camvox/loop/surface_registration.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "camvox/loop/surroundings.hpp"
#include "camvox/test/surface_scene.hpp"

namespace camvox::loop {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using geometry::SE3;
using geometry::SO3;
using test::SurfaceScene;

constexpr double kRange_m = 20.0;
constexpr double kGrain_m = 0.3;
constexpr double kPi = std::numbers::pi;

SE3 pose(double x, double y, double yaw_rad) { return {SO3::exp({0, 0, yaw_rad}), {x, y, 0.0}}; }

/// What stands around a level pose.
SurfaceMap around(const SurfaceScene& scene, const SE3& T_world_level, unsigned seed) {
  std::vector<Vector3f> points;
  for (const auto& p_world : scene.sample(seed)) {
    const Vector3d p = T_world_level.inverse() * p_world;
    if (p.norm() < kRange_m) points.push_back(p.cast<float>());
  }
  return SurfaceMap(thin(points, kGrain_m));
}

class SurfaceRegistrationTest : public testing::Test {
 protected:
  /// The source at x = 2 looks back, the target at x = 0 ahead; the map is `off`.
  Registration attempt(const SurfaceScene& scene, const SE3& off, unsigned seed = 1) {
    const RegistrationStart start{T_target_source_ * off, 4.0, 0.15};
    return register_surfaces(
        around(scene, T_source_, 2 * seed), around(scene, SE3(), 2 * seed + 1), start, {});
  }

  SE3 T_source_ = pose(2.0, 0.5, kPi - 0.1);
  SE3 T_target_source_ = T_source_;
  SE3 off_ = pose(2.1, -1.3, 0.08);
};

TEST_F(SurfaceRegistrationTest, FindsAPlaceFromTheOtherSide) {
  const auto found = attempt(SurfaceScene::street(10.0), off_);
  ASSERT_EQ(found.status, RegistrationStatus::kOk) << found.distinction;
  const auto error = geometry::local(T_target_source_, found.T_target_source);
  EXPECT_LT(error.tail<3>().norm(), 0.06);
  EXPECT_LT(error.head<3>().norm(), 0.004);
  EXPECT_GT(found.points, 500);
}

// Errors in sigma: neither far below nor far above one.
TEST_F(SurfaceRegistrationTest, CovarianceIsHonest) {
  double squared = 0.0;
  constexpr int kScenes = 12;
  for (unsigned seed = 1; seed <= kScenes; ++seed) {
    const auto found = attempt(SurfaceScene::street(10.0, seed), off_, seed);
    ASSERT_EQ(found.status, RegistrationStatus::kOk) << seed;
    const auto error = geometry::local(T_target_source_, found.T_target_source);
    squared += error.dot(found.covariance_source.llt().solve(error)) / 6.0 / kScenes;
  }
  EXPECT_LT(squared, 2.0);
  EXPECT_GT(squared, 0.02);
}

TEST_F(SurfaceRegistrationTest, AnotherPlaceIsNotDistinct) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const auto street = SurfaceScene::street(10.0, seed);
    const auto other = SurfaceScene::street(10.0, 100 + seed);
    const RegistrationStart start{T_target_source_, 6.0, 0.15};
    const auto found =
        register_surfaces(around(street, T_source_, 1), around(other, SE3(), 2), start, {});
    EXPECT_NE(found.status, RegistrationStatus::kOk) << seed << ": " << found.distinction;
  }
}

TEST_F(SurfaceRegistrationTest, ACorridorHoldsNothingAlong) {
  const auto found = attempt(SurfaceScene::corridor(10.0), off_);
  EXPECT_NE(found.status, RegistrationStatus::kOk);
}

TEST_F(SurfaceRegistrationTest, NothingThereIsNothing) {
  const SurfaceMap nothing{std::vector<Vector3f>()};
  const auto street = around(SurfaceScene::street(10.0), SE3(), 1);
  EXPECT_EQ(register_surfaces(nothing, nothing, {}, {}).status, RegistrationStatus::kNothing);
  EXPECT_EQ(register_surfaces(nothing, street, {}, {}).status, RegistrationStatus::kNothing);
  EXPECT_EQ(register_surfaces(street, nothing, {}, {}).status, RegistrationStatus::kNothing);
  const SurfaceMap one(std::vector<Vector3f>(1, Vector3f(1.0F, 2.0F, 3.0F)));
  EXPECT_EQ(register_surfaces(one, street, {}, {}).status, RegistrationStatus::kNothing);
}

TEST_F(SurfaceRegistrationTest, SameInputSameBytes) {
  const auto a = attempt(SurfaceScene::street(10.0), off_);
  const auto b = attempt(SurfaceScene::street(10.0), off_);
  EXPECT_EQ(a.T_target_source.matrix(), b.T_target_source.matrix());
  EXPECT_EQ(a.covariance_source, b.covariance_source);
}

TEST(SurfaceMapTest, NearestIsThatOfBruteForce) {
  const auto points = SurfaceScene::street(10.0).sample(3);
  std::vector<Vector3f> near;
  for (const auto& p : points) {
    if (p.norm() < 12.0) near.push_back(p.cast<float>());
  }
  const SurfaceMap map(near);
  ASSERT_EQ(map.surfaces().size(), near.size());
  for (const auto& p_world : SurfaceScene::street(10.0).sample(4, 0.3)) {
    const Vector3f p = p_world.cast<float>();
    if (p.norm() > 15.0F) continue;
    float best_m = SurfaceMap::kNear_m;
    for (const auto& q : near) best_m = std::min(best_m, (q - p).norm());
    const auto* found = map.nearest(p);
    ASSERT_EQ(found != nullptr, best_m < SurfaceMap::kNear_m) << p.transpose();
    EXPECT_EQ(map.has_within(p, 0.3F), best_m < 0.3F);
    if (found != nullptr) {
      EXPECT_FLOAT_EQ((found->point - p).norm(), best_m);
    }
  }
}

TEST(SurfaceMapTest, TellsPlanesFromWhatIsRough) {
  std::vector<Vector3f> points;
  for (int i = 0; i < 40; ++i) {
    for (int j = 0; j < 20; ++j) {
      points.emplace_back(0.2F * static_cast<float>(i), 5.0F, 0.2F * static_cast<float>(j));
    }
  }
  for (int i = 0; i < 20; ++i) points.emplace_back(-5.0F, 0.0F, 0.1F * static_cast<float>(i));
  const SurfaceMap map(points);
  const auto* wall = map.nearest({4.0F, 5.1F, 2.0F});
  ASSERT_NE(wall, nullptr);
  EXPECT_NEAR(std::abs(wall->normal.y()), 1.0F, 1e-4F);
  const auto* pole = map.nearest({-5.0F, 0.1F, 1.0F});
  ASSERT_NE(pole, nullptr);
  EXPECT_TRUE(pole->rough());
  const auto stands = [&](const Eigen::Vector2f& at) {
    return std::any_of(map.upright().begin(), map.upright().end(), [&](const Eigen::Vector2f& p) {
      return (p - at).cwiseAbs().maxCoeff() <= 0.5F * SurfaceMap::kCell_m + 1e-4F;
    });
  };
  EXPECT_TRUE(stands({-5.0F, 0.0F}));
  EXPECT_TRUE(stands({4.0F, 5.0F}));
  EXPECT_FALSE(stands({0.0F, 0.0F}));
}

}  // namespace
}  // namespace camvox::loop
