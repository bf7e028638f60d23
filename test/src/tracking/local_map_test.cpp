#include "camvox/tracking/local_map.hpp"

#include <gtest/gtest.h>

namespace camvox::tracking {
namespace {

constexpr optimization::PinholeCamera kCamera{500.0, 510.0, 320.0, 240.0, 0.05};
constexpr ScaleLevels kScale{};

Keyframe one_feature(float depth_m) {
  Keyframe keyframe;
  keyframe.id = 3;
  keyframe.T_map_camera = geometry::SE3(geometry::SO3::exp({0.1, -0.2, 0.3}), {1.0, 2.0, 3.0});
  features::KeyPoint point;
  point.octave = 2;
  keyframe.features.key_points = {point};
  keyframe.features.undistorted_px = {{420.0F, 138.0F}};
  keyframe.features.descriptors.resize(1);
  keyframe.features.descriptors[0].bytes[5] = 77;
  keyframe.features.depth_m = {depth_m};
  keyframe.features.depth_sigma_m = {0.03F};
  return keyframe;
}

TEST(LocalMapTest, LandmarkIdHoldsItsFounder) {
  constexpr LandmarkId kId = landmark_id(70000, 4095);
  static_assert(founding_keyframe(kId) == 70000 && founding_feature(kId) == 4095);
}

TEST(LocalMapTest, LandmarkStandsWhereItsFeatureSawIt) {
  const Keyframe keyframe = one_feature(10.0F);
  const auto landmark = landmark_from_depth(keyframe, 0, kCamera, kScale);
  ASSERT_TRUE(landmark.has_value());
  const Eigen::Vector3d p_camera(2.0, -2.0, 10.0);
  EXPECT_LT((landmark->p_map - keyframe.T_map_camera * p_camera).norm(), 1e-9);
  const Eigen::Vector3d f_map = keyframe.T_map_camera.rotation() * p_camera.normalized();
  EXPECT_LT((landmark->f_map.cast<double>() - f_map).norm(), 1e-6);
  EXPECT_EQ(landmark->id, landmark_id(3, 0));
  EXPECT_EQ(landmark->descriptor, keyframe.features.descriptors[0]);
  EXPECT_FLOAT_EQ(landmark->sigma_m, 0.03F);
}

TEST(LocalMapTest, NoLandmarkWithoutDepth) {
  EXPECT_FALSE(landmark_from_depth(one_feature(0.0F), 0, kCamera, kScale));
}

TEST(LocalMapTest, OctaveFollowsTheDistance) {
  for (int octave = 0; octave < kScale.levels; ++octave) {
    const auto range = distance_range(10.0F, octave, kScale);
    EXPECT_EQ(predicted_octave(10.0F, range.max_m, kScale), octave);
    EXPECT_EQ(predicted_octave(0.5F * range.min_m, range.max_m, kScale), kScale.levels - 1);
    EXPECT_EQ(predicted_octave(2.0F * range.max_m, range.max_m, kScale), 0);
  }
}

}  // namespace
}  // namespace camvox::tracking
