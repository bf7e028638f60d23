#include "camvox/loop/surroundings.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>

namespace camvox::loop {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;
using geometry::SE3;
using geometry::SO3;

std::vector<Vector3f> random_points(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(-8.0F, 8.0F);
  std::vector<Vector3f> points;
  for (int i = 0; i < count; ++i) points.emplace_back(unit(random), unit(random), unit(random));
  return points;
}

TEST(ThinTest, OneMeanPointPerCube) {
  const auto points = random_points(20000);
  std::map<std::tuple<int, int, int>, std::pair<Vector3d, int>> cubes;
  for (const auto& p : points) {
    const Eigen::Vector3i cube = (p / 0.5F).array().floor().cast<int>();
    auto& [sum, count] =
        cubes.try_emplace({cube.x(), cube.y(), cube.z()}, Vector3d::Zero(), 0).first->second;
    sum += p.cast<double>();
    ++count;
  }
  const auto thinned = thin(points, 0.5);
  ASSERT_EQ(thinned.size(), cubes.size());
  for (const auto& p : thinned) {
    const Eigen::Vector3i cube = (p / 0.5F).array().floor().cast<int>();
    const auto& [sum, count] = cubes.at({cube.x(), cube.y(), cube.z()});
    EXPECT_LT((sum / count - p.cast<double>()).norm(), 1e-4);
  }
  EXPECT_TRUE(thin({}, 0.5).empty());
}

/// A camera that looks along x of a world with z up, `x` metres along.
SE3 camera_at(double x) {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {SO3::from_matrix(R), {x, 0.0, 1.5}};
}

TEST(GatherTest, PointsOfAllViewsInOneLevelFrame) {
  const std::vector<Vector3d> world = {{12.0, 3.0, 0.0}, {9.0, -4.0, 2.5}, {4.0, 2.0, 0.5}};
  std::vector<std::vector<Vector3f>> seen;
  std::vector<SurfaceView> views;
  const SE3 T_world_place = camera_at(6.0);
  for (std::size_t i = 0; i < world.size(); ++i) {
    const SE3 T_world_camera = camera_at(3.0 * static_cast<double>(i));
    seen.push_back({(T_world_camera.inverse() * world[i]).cast<float>()});
  }
  for (std::size_t i = 0; i < world.size(); ++i) {
    views.push_back({seen[i], T_world_place.inverse() * camera_at(3.0 * static_cast<double>(i))});
  }
  const auto around = gather(views, 2, {.grain_m = 0.05});
  ASSERT_EQ(around.points_level.size(), world.size());
  for (const auto& p_world : world) {
    const Vector3d expected = p_world - Vector3d(6.0, 0.0, 1.5);  // x ahead, z up
    const auto same = [&](const Vector3f& p) {
      return (p.cast<double>() - expected).norm() < 1e-4;
    };
    EXPECT_TRUE(std::any_of(around.points_level.begin(), around.points_level.end(), same))
        << expected.transpose();
  }
  const auto T_world_level = T_world_place * around.T_place_level;
  EXPECT_LT((T_world_level.rotation().matrix() - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

TEST(GatherTest, WhatIsFarHighOrNoNumberStaysOut) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<Vector3f> points = {
      {0.0F, 0.0F, 5.0F}, {0.0F, 0.0F, 21.0F}, {0.0F, -7.0F, 5.0F}, {nan, 0.0F, 5.0F}};
  const std::vector<SurfaceView> views = {{points, SE3()}};
  EXPECT_EQ(gather(views, 0, {}).points_level.size(), 1U);
}

// The path is on the ground, whatever the cameras' pitch.
TEST(GatherTest, UpIsPerpendicularToThePath) {
  const SE3 down(SO3::exp({-0.1, 0.0, 0.0}), Vector3d::Zero());
  std::vector<SurfaceView> views;
  for (const double x : {0.0, 5.0, 10.0}) {
    views.push_back({{}, (camera_at(5.0) * down).inverse() * camera_at(x) * down});
  }
  const SE3 T_world_level = camera_at(5.0) * down * gather(views, 1, {}).T_place_level;
  EXPECT_LT((T_world_level.rotation() * Vector3d::UnitZ() - Vector3d::UnitZ()).norm(), 1e-9);
}

}  // namespace
}  // namespace camvox::loop
