#include "camvox/loop/geometric_verification.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "camvox/test/feature_world.hpp"

namespace camvox::loop {
namespace {

using geometry::SE3;
using test::FeatureWorld;

class VerificationTest : public testing::Test {
 protected:
  VerificationTest() { world_.add_box(400, {0.0, 0.0, 12.0}, {14.0, 6.0, 10.0}); }

  Verification verify_views(const features::FrameFeatures& query,
                            const features::FrameFeatures& match) const {
    return verify(query, {{&match, SE3()}}, world_.camera, config_);
  }

  FeatureWorld world_;
  VerificationConfig config_;
  SE3 T_world_query_{geometry::SO3::exp({0.02, 0.15, -0.03}), {0.8, -0.1, 0.9}};
};

TEST_F(VerificationTest, FindsThePose) {
  const auto match = world_.look(SE3());
  const auto query = world_.look(T_world_query_);
  const auto result = verify_views(query, match);
  ASSERT_EQ(result.status, VerificationStatus::kOk) << to_string(result.status);
  const auto error = geometry::local(T_world_query_, result.T_place_query);
  // 200 points with half a pixel of 500 px focal length: 0.1 mrad; 2 cm of depth: 2 mm.
  EXPECT_LT(error.head<3>().norm(), 1e-3);
  EXPECT_LT(error.tail<3>().norm(), 0.01);
  EXPECT_GT(result.inliers, 150);
  // The covariance tells the truth: 6 dimensions, 99.99 % below 27.9.
  EXPECT_LT(error.dot(result.covariance_query.llt().solve(error)), 28.0);
}

TEST_F(VerificationTest, NeighboursAddFeatures) {
  const SE3 T_far(geometry::SO3::exp({0.0, -0.5, 0.0}), {-2.0, 0.0, 0.0});
  const auto match = world_.look(T_far);
  const auto neighbour = world_.look(SE3());
  const auto query = world_.look(T_world_query_);
  const auto alone = verify(query, {{&match, SE3()}}, world_.camera, config_);
  const auto both =
      verify(query, {{&match, SE3()}, {&neighbour, T_far.inverse()}}, world_.camera, config_);
  EXPECT_EQ(both.status, VerificationStatus::kOk);
  EXPECT_GT(both.inliers, alone.inliers + 10);
}

TEST_F(VerificationTest, AnotherPlaceIsNone) {
  FeatureWorld other(99);
  other.add_box(400, {3.0, 0.0, 30.0}, {14.0, 6.0, 10.0});
  other.add_box(400, {0.0, 0.0, 12.0}, {14.0, 6.0, 10.0});
  const auto result = verify_views(other.look(SE3()), world_.look(SE3()));
  EXPECT_EQ(result.status, VerificationStatus::kTooFewMatches);
}

// The same things, but arranged differently: no rigid motion.
TEST_F(VerificationTest, ScrambledPointsAreNoPlace) {
  const auto match = world_.look(SE3());
  auto query = match;
  std::mt19937 random(3);
  std::shuffle(query.undistorted_px.begin(), query.undistorted_px.end(), random);
  std::shuffle(query.depth_m.begin(), query.depth_m.end(), random);
  EXPECT_EQ(verify_views(query, match).status, VerificationStatus::kNoRigidMotion);
}

// A poster seen somewhere else: it agrees with itself, but in one spot of the image only.
TEST_F(VerificationTest, OneSmallObjectIsNoPlace) {
  FeatureWorld here;
  here.add_box(60, {0.0, 0.0, 8.0}, {1.0, 1.0, 0.2});
  FeatureWorld there = here;
  there.reseed(99);
  here.add_box(300, {0.0, 0.0, 14.0}, {14.0, 6.0, 8.0});
  there.add_box(300, {1.0, 0.0, 14.0}, {14.0, 6.0, 8.0});
  const auto result = verify_views(here.look(SE3()), there.look(SE3()));
  EXPECT_NE(result.status, VerificationStatus::kOk) << result.inliers << " in " << result.cells;
}

// A wall has come up in front of what the map knows: half the surfaces are gone.
TEST_F(VerificationTest, OtherSurfacesAreNoPlace) {
  const auto match = world_.look(SE3());
  auto query = world_.look(SE3());
  for (std::size_t i = 0; i < query.size(); ++i) {
    if (query.depth_m[i] > 0.0F && i % 8 > 1) query.depth_m[i] *= 0.6F;
  }
  config_.min_inliers = 20;
  const auto result = verify_views(query, match);
  EXPECT_NE(result.status, VerificationStatus::kOk);
}

TEST_F(VerificationTest, NothingComesOfNothing) {
  const features::FrameFeatures none;
  const auto some = world_.look(SE3());
  EXPECT_EQ(verify_views(none, some).status, VerificationStatus::kTooFewMatches);
  EXPECT_EQ(verify_views(some, none).status, VerificationStatus::kTooFewMatches);
  EXPECT_EQ(verify(some, {}, world_.camera, config_).status, VerificationStatus::kTooFewMatches);
}

TEST_F(VerificationTest, NoDepthIsNoPose) {
  const auto match = world_.look(SE3());
  auto query = world_.look(T_world_query_);
  std::fill(query.depth_m.begin(), query.depth_m.end(), 0.0F);
  EXPECT_EQ(verify_views(query, match).status, VerificationStatus::kNoRigidMotion);
}

TEST_F(VerificationTest, TheSameAgain) {
  const auto match = world_.look(SE3());
  const auto query = world_.look(T_world_query_);
  EXPECT_EQ(verify_views(query, match).T_place_query.matrix(),
            verify_views(query, match).T_place_query.matrix());
}

}  // namespace
}  // namespace camvox::loop
