#include "camvox/dense/dense_map.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

namespace camvox::dense {
namespace {

using geometry::SE3;
using geometry::SO3;

sensors::CameraIntrinsics small_camera() {
  sensors::CameraIntrinsics camera;
  camera.width_px = 64;
  camera.height_px = 48;
  camera.fx_px = camera.fy_px = 50.0;
  camera.cx_px = 31.5;
  camera.cy_px = 23.5;
  camera.distortion = {};
  return camera;
}

/// A wall `z` m ahead of the camera, grey 200.
struct Wall {
  explicit Wall(float z) : depth_m(64 * 48, z), sigma_m(64 * 48, 0.02F) {}
  [[nodiscard]] DepthImageView depth() const { return {depth_m.data(), sigma_m.data(), 64, 48}; }
  [[nodiscard]] static ColourAt image() {
    return [](int, int) { return Rgb{200, 200, 200}; };
  }

  std::vector<float> depth_m;
  std::vector<float> sigma_m;
};

DenseMap make_map(DenseMapConfig config = {}) {
  return DenseMap(config, sensors::CameraModel(small_camera()));
}

SE3 at(double x, double y = 0.0, double z = 0.0) { return {SO3(), {x, y, z}}; }

TEST(DenseMap, PointsLieOnTheWallInTheirColour) {
  auto map = make_map({.stride_px = 1});
  const Wall wall(5.0F);
  EXPECT_GT(map.add_keyframe(1, at(1.0, 2.0, 3.0), wall.depth(), wall.image()), 1000U);
  for (const auto& point : map.points()) {
    EXPECT_NEAR(point.p.z(), 8.0, 1e-5);
    EXPECT_EQ(point.rgb, (Rgb{200, 200, 200}));
  }
  // The wall is 6.3 m wide: of 64 pixels 0.1 m apart each column has its voxel, or shares one.
  EXPECT_EQ(map.size(), map.points().size());
}

TEST(DenseMap, OnePointAVoxelAlsoAcrossKeyframes) {
  auto map = make_map({.stride_px = 1});
  const Wall wall(5.0F);
  const auto first = map.add_keyframe(1, at(0.0), wall.depth(), wall.image());
  EXPECT_LT(map.add_keyframe(2, at(0.0), wall.depth(), wall.image()), 1U) << "seen already";
  const auto beside = map.add_keyframe(3, at(3.0), wall.depth(), wall.image());
  EXPECT_LT(beside, 0.6 * static_cast<double>(first)) << "half of it is new";
  std::set<std::array<long, 3>> voxels;
  for (const auto& point : map.points()) {
    voxels.insert({std::lround(std::floor(point.p.x() / 0.1)),
                   std::lround(std::floor(point.p.y() / 0.1)),
                   std::lround(std::floor(point.p.z() / 0.1))});
  }
  EXPECT_EQ(voxels.size(), map.size());
}

TEST(DenseMap, PointsMoveWithTheirKeyframe) {
  auto map = make_map();
  const Wall wall(5.0F);
  (void)map.add_keyframe(1, at(0.0), wall.depth(), wall.image());
  map.move_keyframe(1, at(0.0, 0.0, 2.0));
  for (const auto& point : map.points()) EXPECT_NEAR(point.p.z(), 7.0, 1e-5);
  EXPECT_GT(map.add_keyframe(2, at(0.0), wall.depth(), wall.image()), 100U)
      << "where the wall was there is room again";
}

TEST(DenseMap, PointsOfARemovedKeyframeStayWhereTheyAre) {
  auto map = make_map();
  const Wall wall(5.0F);
  (void)map.add_keyframe(1, at(0.0), wall.depth(), wall.image());
  (void)map.add_keyframe(2, at(0.0, 0.0, 10.0), wall.depth(), wall.image());
  const auto before = map.size();
  map.remove_keyframe(2);
  EXPECT_EQ(map.size(), before);
  EXPECT_NEAR(map.points().back().p.z(), 15.0, 1e-4);
  map.move_keyframe(1, at(0.0, 0.0, 1.0));
  EXPECT_NEAR(map.points().back().p.z(), 16.0, 1e-4);
  map.remove_keyframe(1);
  EXPECT_EQ(map.size(), before) << "the last keyframe stays";
}

TEST(DenseMap, MemoryIsBoundedByThinningTheOldest) {
  auto map = make_map({.stride_px = 1, .max_points = 15000});
  const Wall wall(5.0F);
  for (int i = 0; i < 20; ++i) {
    (void)map.add_keyframe(static_cast<std::uint64_t>(i), at(10.0 * i), wall.depth(), wall.image());
    EXPECT_LE(map.size(), 15000U);
  }
  std::size_t oldest = 0;
  std::size_t newest = 0;
  for (const auto& point : map.points()) {
    oldest += point.p.x() < 5.0F ? 1 : 0;
    newest += point.p.x() > 185.0F ? 1 : 0;
  }
  EXPECT_GT(oldest, 0U);
  EXPECT_GT(newest, oldest);
}

TEST(DenseMap, VoxelsAreBoundedAsThePointsAre) {
  constexpr std::size_t kLimit = 15000;
  auto map = make_map({.stride_px = 1, .max_points = kLimit});
  const Wall wall(5.0F);
  std::size_t most = 0;
  std::size_t added = 0;
  for (int i = 0; i < 200; ++i) {
    added +=
        map.add_keyframe(static_cast<std::uint64_t>(i), at(10.0 * i), wall.depth(), wall.image());
    most = std::max(most, map.voxel_count());
  }
  ASSERT_GT(added, 30 * kLimit);
  // Tidied up when a keyframe begins, so one keyframe of 64 x 48 pixels may go over.
  EXPECT_LE(most, 2 * kLimit + 64 * 48);
  EXPECT_GE(map.voxel_count(), map.size()) << "what is there stays occupied";
}

TEST(DenseMap, LeavesOutWhatIsNoGoodDepth) {
  auto map = make_map();
  Wall wall(0.0F);
  EXPECT_EQ(map.add_keyframe(1, at(0.0), wall.depth(), wall.image()), 0U);
  Wall uncertain(5.0F);
  uncertain.sigma_m.assign(64 * 48, 1.0F);
  EXPECT_EQ(map.add_keyframe(2, at(0.0), uncertain.depth(), uncertain.image()), 0U);
  EXPECT_EQ(map.add_keyframe(3, at(0.0), Wall(80.0F).depth(), wall.image()), 0U);
  Wall nothing(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(map.add_keyframe(4, at(0.0), nothing.depth(), wall.image()), 0U);
}

TEST(DenseMap, RefusesImagesOfAnotherSizeAndBadConfigs) {
  auto map = make_map();
  const Wall wall(5.0F);
  auto depth = wall.depth();
  depth.width_px = 32;
  EXPECT_THROW((void)map.add_keyframe(1, at(0.0), depth, wall.image()), std::logic_error);
  EXPECT_THROW((void)make_map({.voxel_size_m = 0.0}), config::ConfigError);
}

}  // namespace
}  // namespace camvox::dense
