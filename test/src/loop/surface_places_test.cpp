#include "camvox/loop/surface_places.hpp"

#include <gtest/gtest.h>

#include "camvox/loop/loop_closer.hpp"
#include "camvox/test/there_and_back.hpp"

namespace camvox::loop {
namespace {

using geometry::SE3;
using test::SurfaceScene;
using test::ThereAndBack;

class SurfacePlacesTest : public testing::Test {
 protected:
  void drive(ThereAndBack& world) {
    poses_.clear();
    for (std::size_t i = 0; i < ThereAndBack::kKeyframes; ++i) {
      const auto keyframe = world.keyframe(i, poses_.empty() ? SE3() : poses_.back());
      poses_.push_back(keyframe.T_map_camera);
      closer_->insert(keyframe);
      MapChange change;
      for (std::size_t k = ThereAndBack::first_neighbour(i); k < i; ++k) {
        change.edges.push_back({k + 1, i + 1, 50});
      }
      closer_->update(change);
      const auto places = verify(closer_->detect(keyframe.id), world.camera(), closer_->config());
      if (const auto task = closer_->consider(keyframe.id, places)) apply(correct(*task));
    }
  }

  void apply(const Correction& correction) {
    ASSERT_TRUE(correction.summary.usable);
    EXPECT_TRUE(correction.loop.by_surfaces);
    closer_->finish(correction);
    MapChange change;
    change.map_epoch = correction.map_epoch + 1;
    change.T_map_camera = correction.T_map_camera;
    closer_->update(change);
    for (const auto& [id, T] : correction.T_map_camera) poses_[id - 1] = T;
  }

  /// How far the map has the end of the way back from where it is, seen from the start.
  [[nodiscard]] double error_m() const {
    const std::size_t last = poses_.size() - 1;
    return (poses_[last].translation() - ThereAndBack::truth(last).translation()).norm();
  }

  void configure(const LoopCloserConfig& config) { closer_.emplace(config); }

  std::optional<LoopCloser> closer_{LoopCloserConfig()};
  std::vector<SE3> poses_;
};

TEST_F(SurfacePlacesTest, ClosesAWayBack) {
  ThereAndBack world(SurfaceScene::street(ThereAndBack::kLength_m));
  LoopCloserConfig blind;
  blind.surfaces.enabled = false;
  configure(blind);
  drive(world);
  EXPECT_EQ(closer_->statistics().surfaces_compared, 0U);
  EXPECT_TRUE(closer_->loops().empty());
  const double drift_m = error_m();
  EXPECT_GT(drift_m, 1.0);

  configure({});
  drive(world);
  EXPECT_GE(closer_->statistics().surface_loops, 3U);
  EXPECT_LT(error_m(), 0.3 * drift_m);
  for (const auto& loop : closer_->loops()) {
    const SE3 T =
        ThereAndBack::truth(loop.match_id - 1).inverse() * ThereAndBack::truth(loop.query_id - 1);
    const auto error = geometry::local(T, loop.T_match_query);
    EXPECT_LT(error.tail<3>().norm(), 0.3);  // 25 m of way to either side, measured 0.7 % too long
    EXPECT_LT(error.head<3>().norm(), 0.02);
    EXPECT_TRUE(loop.by_surfaces);
  }
}

// Surfaces tell less than a map that has not drifted.
TEST_F(SurfacePlacesTest, AGoodMapStaysAsItIs) {
  ThereAndBack world(SurfaceScene::street(ThereAndBack::kLength_m));
  world.drift_rad = 0.0;
  drive(world);
  EXPECT_GE(closer_->statistics().surfaces_confirmed, 3U);
  EXPECT_EQ(closer_->statistics().corrections, 0U);
  EXPECT_TRUE(closer_->loops().empty());
}

// Walls say nothing about how far along the robot is.
TEST_F(SurfacePlacesTest, ACorridorIsNoLoop) {
  ThereAndBack world(SurfaceScene::corridor(ThereAndBack::kLength_m));
  drive(world);
  EXPECT_GE(closer_->statistics().surfaces_compared, 3U);
  EXPECT_EQ(closer_->statistics().surfaces_confirmed, 0U);
  EXPECT_TRUE(closer_->loops().empty());
}

TEST_F(SurfacePlacesTest, TheNearestPlacePassedTheOtherWay) {
  ThereAndBack world(SurfaceScene::street(ThereAndBack::kLength_m));
  world.drift_rad = 0.0;
  LoopCloserConfig config;
  config.surfaces.enabled = false;  // asked by hand here
  configure(config);
  drive(world);
  auto surfaces = config.surfaces;
  surfaces.enabled = true;
  surfaces.max_views = 7;
  const auto find = [&](KeyframeId id) {
    return find_surface_place(closer_->map(), id, {}, config.drift, surfaces);
  };
  // Keyframe i + 1 is at 2 i metres there, at 120 - 2 i metres back.
  const auto task = find(54);  // 106 m: 14 m from the start
  ASSERT_TRUE(task);
  EXPECT_EQ(task->match_id, 8U);
  EXPECT_LT(geometry::local(task->T_match_query,
                            ThereAndBack::truth(7).inverse() * ThereAndBack::truth(53))
                .norm(),
            1e-9);
  EXPECT_GT(task->search_m, 2.0);  // 1.5 % of 92 m, with a margin
  EXPECT_LE(task->search_m, surfaces.max_search_m);
  ASSERT_EQ(task->match.features.size(), 7U);
  EXPECT_EQ(task->match.centre, 3U);
  EXPECT_LT(task->match.T_keyframe_camera[3].log().norm(), 1e-12);
  EXPECT_EQ(task->query.centre, 3U);

  EXPECT_FALSE(find(55));   // not its turn
  EXPECT_FALSE(find(999));  // not there
  EXPECT_FALSE(find(21));   // on the way there
  EXPECT_FALSE(find(36));   // just turned: 20 m along the path
  surfaces.enabled = false;
  EXPECT_FALSE(find(54));
  // A loop that was closed there leaves little to search.
  surfaces.enabled = true;
  const auto closed = find_surface_place(closer_->map(), 54, {{54, 8}}, config.drift, surfaces);
  ASSERT_TRUE(closed);
  EXPECT_LT(closed->search_m, 1.1);
}

}  // namespace
}  // namespace camvox::loop
