#include "camvox/loop/loop_closer.hpp"

#include <gtest/gtest.h>

#include "camvox/test/feature_world.hpp"

namespace camvox::loop {
namespace {

using geometry::SE3;
using test::FeatureWorld;
using test::on_circle;

constexpr double kRadius_m = 20.0;

/// A robot that drives around a circle and on, with odometry that turns too little and measures
/// too long, and a map that takes every correction over as it is.
class LoopCloserTest : public testing::Test {
 protected:
  LoopCloserTest() {
    for (int i = 0; i < 60; ++i) {
      const double angle = i * 2.0 * M_PI / 60.0;
      world_.add_box(60, on_circle(angle, kRadius_m).translation(), {9.0, 5.0, 9.0});
    }
  }

  static SE3 truth(std::size_t i) {
    return on_circle(static_cast<double>(i) / kRadius_m, kRadius_m);
  }

  void drive_to(std::size_t i) {
    tracking::Keyframe keyframe;
    keyframe.id = poses_.size() + 1;
    keyframe.parent_id = poses_.size();
    keyframe.features = world_.look(truth(i), 12.0);
    keyframe.T_map_camera = truth(i);
    if (!poses_.empty()) {
      const SE3 step = truth(last_).inverse() * truth(i);
      const SE3 wrong(geometry::SO3::exp({0.0, drift_rad_, 0.0}), 0.005 * step.translation());
      keyframe.T_map_camera = poses_.back() * step * wrong;
    }
    last_ = i;
    poses_.push_back(keyframe.T_map_camera);
    closer_.insert(keyframe);
    const auto places = verify(closer_.detect(keyframe.id), world_.camera, closer_.config());
    const auto task = closer_.consider(keyframe.id, places);
    if (task) apply(correct(*task));
  }

  void apply(const Correction& correction) {
    ASSERT_TRUE(correction.summary.usable);
    closer_.finish(correction);
    MapChange change;
    change.map_epoch = correction.map_epoch + 1;
    change.T_map_camera = correction.T_map_camera;
    closer_.update(change);
    for (const auto& [id, T] : correction.T_map_camera) poses_[id - 1] = T;
  }

  [[nodiscard]] double error_at_m(std::size_t id, std::size_t i) const {
    return (poses_[id - 1].translation() - truth(i).translation()).norm();
  }

  FeatureWorld world_;
  LoopCloser closer_{LoopCloserConfig()};
  std::vector<SE3> poses_;
  std::size_t last_ = 0;
  double drift_rad_ = 5e-4;
};

TEST_F(LoopCloserTest, ClosesACircle) {
  for (std::size_t i = 0; i < 120; ++i) drive_to(i);
  EXPECT_TRUE(closer_.loops().empty());
  const double drift_m = error_at_m(120, 119);
  EXPECT_GT(drift_m, 0.5);
  for (std::size_t i = 120; i < 140; ++i) drive_to(i);
  EXPECT_GT(closer_.loops().size(), 5U);
  EXPECT_GE(closer_.statistics().corrections, 1U);
  EXPECT_LT(error_at_m(130, 129), 0.3 * drift_m);
  for (const auto& loop : closer_.loops()) {
    const SE3 T = truth(loop.match_id - 1).inverse() * truth(loop.query_id - 1);
    EXPECT_LT(geometry::local(T, loop.T_match_query).norm(), 0.05);
  }
}

// Two stretches that look exactly alike. There is nothing to tell them apart but where the robot
// can be: it has driven 60 m, and the map cannot be wrong by the 40 m between them.
TEST_F(LoopCloserTest, IdenticalFacadesAreNoLoop) {
  FeatureWorld twins;
  for (int i = 0; i < 12; ++i) {
    twins.add_box(60, on_circle(i * 0.1, kRadius_m).translation(), {9.0, 5.0, 9.0});
  }
  const std::size_t size = twins.size();
  twins.add_copy(0, size, truth(60) * truth(0).inverse());
  world_ = twins;
  for (std::size_t i = 0; i < 84; ++i) drive_to(i);
  EXPECT_GT(closer_.statistics().places_confirmed, 5U);  // they do look alike
  EXPECT_EQ(closer_.statistics().implausible, closer_.statistics().places_confirmed);
  EXPECT_TRUE(closer_.loops().empty());
  EXPECT_EQ(closer_.statistics().corrections, 0U);
}

TEST_F(LoopCloserTest, RelocalisesAnywhere) {
  drift_rad_ = 0.0;
  for (std::size_t i = 0; i < 110; i += 2) drive_to(i);
  for (const std::size_t i : {5U, 37U, 91U}) {
    const SE3 T = truth(i) * SE3(geometry::SO3::exp({0.0, 0.1, 0.0}), {0.3, 0.1, 0.0});
    const auto frame = std::make_shared<features::FrameFeatures>(world_.look(T, 12.0));
    const auto answer =
        closer_.relocalise(verify(closer_.detect_lost(frame), world_.camera, closer_.config()));
    ASSERT_TRUE(answer);
    const auto* keyframe = closer_.map().find(answer->keyframe_ids.front());
    ASSERT_NE(keyframe, nullptr);
    const SE3 T_keyframe = truth(2 * (answer->keyframe_ids.front() - 1)).inverse() * T;
    EXPECT_LT(
        geometry::local(T_keyframe, keyframe->T_map_camera.inverse() * answer->T_map_camera).norm(),
        0.05);
  }
}

TEST_F(LoopCloserTest, DoesNotGuessBetweenTwins) {
  FeatureWorld twins;
  twins.add_box(700, on_circle(0.3, kRadius_m).translation(), {9.0, 5.0, 16.0});
  twins.add_copy(0, twins.size(), truth(60) * truth(0).inverse());
  world_ = twins;
  for (std::size_t i = 0; i < 70; ++i) drive_to(i);
  const auto frame = std::make_shared<features::FrameFeatures>(world_.look(truth(1), 12.0));
  EXPECT_FALSE(
      closer_.relocalise(verify(closer_.detect_lost(frame), world_.camera, closer_.config())));
}

TEST_F(LoopCloserTest, ForgetsRemovedKeyframes) {
  for (std::size_t i = 0; i < 135; ++i) drive_to(i);
  ASSERT_FALSE(closer_.loops().empty());
  MapChange change;
  change.removed = {closer_.loops().front().match_id};
  closer_.update(change);
  EXPECT_EQ(closer_.map().find(change.removed[0]), nullptr);
  EXPECT_EQ(closer_.index().keyframes(), 134U);
  for (const auto& loop : closer_.loops()) EXPECT_NE(loop.match_id, change.removed[0]);
}

// A place beside one that is confirmed says nothing new; one elsewhere may show a twin.
TEST_F(LoopCloserTest, VerifiesOnePlaceOnce) {
  drift_rad_ = 0.0;
  for (std::size_t i = 0; i < 60; ++i) drive_to(i);
  auto task =
      closer_.detect_lost(std::make_shared<features::FrameFeatures>(world_.look(truth(20), 12.0)));
  ASSERT_GE(task.candidates.size(), 1U);
  task.candidates = {task.candidates[0], task.candidates[0]};
  const auto count = [&] { return verify(task, world_.camera, closer_.config()).size(); };
  EXPECT_EQ(count(), 2U);
  task.same_place_m = 10.0;
  EXPECT_EQ(count(), 1U);
  task.candidates[1].p_map_match.x() += 11.0;
  EXPECT_EQ(count(), 2U);
  task.query = std::make_shared<features::FrameFeatures>(world_.look(truth(80), 12.0));
  EXPECT_EQ(count(), 2U);  // none was confirmed
}

VerifiedPlace looks_like(KeyframeId match_id) {
  VerifiedPlace place;
  place.match_id = match_id;
  place.verification.status = VerificationStatus::kOk;
  place.verification.covariance_query = 1e-4 * geometry::Matrix6d::Identity();
  place.verification.inliers = 100;
  return place;
}

// A warehouse: aisles of 100 m, 10 m apart, that all look alike, driven to and fro. Aisles 0 and 2
// are 220 m of path apart, and the map is good enough to know that they are not one.
TEST(LoopCloserWarehouseTest, TwinsFarApartAlongThePathAreAmbiguous) {
  constexpr std::size_t kAisles = 10;
  constexpr std::size_t kInAisle = 51;  // keyframes, 2 m apart
  constexpr std::size_t kBetween = 4;
  LoopCloser closer{LoopCloserConfig()};
  KeyframeId id = 0;
  const auto add = [&](const SE3& T_map_camera) {
    tracking::Keyframe keyframe;
    keyframe.id = ++id;
    keyframe.parent_id = id - 1;
    keyframe.T_map_camera = T_map_camera;
    closer.insert(keyframe);
  };
  const auto at = [](double x_m, double z_m, double yaw_rad) {
    return SE3(geometry::SO3::exp({0.0, yaw_rad, 0.0}), {x_m, 0.0, z_m});
  };
  for (std::size_t aisle = 0; aisle < kAisles; ++aisle) {
    const bool up = aisle % 2 == 0;
    const double x_m = 10.0 * static_cast<double>(aisle);
    for (std::size_t i = 0; i < kInAisle; ++i) {
      const double way_m = 2.0 * static_cast<double>(i);
      add(at(x_m, up ? way_m : 100.0 - way_m, up ? 0.0 : M_PI));
    }
    for (std::size_t i = 1; i <= kBetween; ++i) {
      add(at(x_m + 2.0 * static_cast<double>(i), up ? 102.0 : -2.0, M_PI / 2.0));
    }
  }
  for (int i = 49; i >= 0; --i) add(at(2.0 * i, -6.0, -M_PI / 2.0));
  for (std::size_t i = 0; i < 6; ++i) {
    add(at(0.0, 2.0 * static_cast<double>(i), 0.0));
    const KeyframeId in_aisle_0 = 1 + i;
    const KeyframeId in_aisle_2 = in_aisle_0 + 2 * (kInAisle + kBetween);
    EXPECT_FALSE(closer.consider(id, {looks_like(in_aisle_0), looks_like(in_aisle_2)}));
    EXPECT_EQ(closer.statistics().ambiguous, i + 1);
  }
  EXPECT_TRUE(closer.loops().empty());
  // One place alone is no contradiction.
  for (std::size_t i = 6; i < 12; ++i) {
    add(at(0.0, 2.0 * static_cast<double>(i), 0.0));
    (void)closer.consider(id, {looks_like(1 + i)});
  }
  EXPECT_FALSE(closer.loops().empty());
}

// The loop's metre is shared by all steps of the way, whatever came first.
TEST(CorrectTest, KeyframesThatCameBeforeTheirParentsStayTiedToTheMap) {
  for (const auto& order : {std::vector<KeyframeId>{1, 2, 3, 4, 5, 6, 7, 8, 9, 10},
                            std::vector<KeyframeId>{4, 5, 6, 7, 8, 9, 10, 1, 2, 3},
                            std::vector<KeyframeId>{5, 6, 7, 8, 9, 10, 1, 2, 3}}) {  // 4 is lost
    LoopCloserConfig config;
    config.consistent_queries = 1;
    LoopCloser closer(config);
    for (const auto id : order) {
      tracking::Keyframe keyframe;
      keyframe.id = id;
      keyframe.parent_id = id - 1;
      keyframe.T_map_camera = SE3({}, {0.0, 0.0, static_cast<double>(id)});
      closer.insert(keyframe);
    }
    auto place = looks_like(1);
    place.verification.T_place_query = SE3({}, {0.5, 0.0, 9.0});
    place.verification.covariance_query *= 0.01;
    const auto task = closer.consider(10, {place});
    ASSERT_TRUE(task);
    const auto correction = correct(*task);
    ASSERT_EQ(correction.T_map_camera.size(), order.size());
    for (std::size_t i = 1; i < correction.T_map_camera.size(); ++i) {
      const double step_m = correction.T_map_camera[i].second.translation().x() -
                            correction.T_map_camera[i - 1].second.translation().x();
      EXPECT_LT(step_m, order.size() == 10 ? 0.1 : 0.15) << correction.T_map_camera[i].first;
      EXPECT_GT(step_m, 0.02) << correction.T_map_camera[i].first;
    }
  }
}

// A graph that rejects all its loops has nothing to say; it must not pass for a closed loop.
TEST(CorrectTest, RejectedLoopsMoveNothing) {
  CorrectionTask task;
  task.keyframe_ids = {1, 2};
  task.graph.T_map_node = {SE3(), SE3(geometry::SO3(), {1.0, 0.0, 0.0})};
  task.graph.fixed = {true, false};
  const auto covariance = path_sigma(0.0, DriftConfig()).covariance();
  task.graph.edges.push_back({0, 1, task.graph.T_map_node[1], covariance, false});
  task.graph.edges.push_back({0, 1, SE3(geometry::SO3(), {9.0, 0.0, 0.0}), covariance, true});
  task.robust_edges = {{2, 1}};
  const auto correction = correct(task);
  EXPECT_EQ(correction.rejected_loops, task.robust_edges);
  EXPECT_TRUE(correction.T_map_camera.empty());
  task.graph.edges.back().T_from_to = SE3(geometry::SO3(), {1.05, 0.0, 0.0});
  EXPECT_EQ(correct(task).T_map_camera.size(), 2U);
}

// The reference solves both starts to the end: the map as it is, and where the loop holds.
TEST(CorrectTest, TheBetterOfTwoMinimaWins) {
  constexpr int kNodes = 10;
  const auto covariance = path_sigma(0.0, DriftConfig()).covariance();
  const double sigma_m = std::sqrt(covariance(5, 5));
  bool held = false, left_out = false;
  for (int offset_sigma = 0; offset_sigma <= 40; ++offset_sigma) {
    CorrectionTask task;
    task.config.relative_tolerance = 1e-9;
    auto& graph = task.graph;
    for (int i = 0; i < kNodes; ++i) {
      task.keyframe_ids.push_back(i + 1);
      graph.T_map_node.emplace_back(geometry::SO3(), Eigen::Vector3d(1.0 * i, 0.0, 0.0));
      graph.fixed.push_back(i == 0);
      if (i > 0) graph.edges.push_back({i - 1U, 1U * i, SE3({}, {1.0, 0.0, 0.0}), covariance});
    }
    const SE3 loop({}, {kNodes - 1.0, 0.0, offset_sigma * sigma_m});
    graph.edges.push_back({0, kNodes - 1, loop, covariance, true});
    task.robust_edges = {{kNodes, 1}};
    auto bent = graph;
    for (int i = 0; i < kNodes; ++i)
      bent.T_map_node[i] = SE3({}, {1.0 * i, 0.0, offset_sigma * sigma_m * i / (kNodes - 1)});
    const auto from_map = optimization::solve_with_all_edges(graph, task.config);
    const auto from_loop = optimization::solve_with_all_edges(bent, task.config);
    const bool bends = from_loop.summary.cost_after < from_map.summary.cost_after;
    const auto expected =
        optimization::leave_out_outliers(graph, bends ? from_loop : from_map, task.config);
    const auto correction = correct(task);
    EXPECT_EQ(correction.rejected_loops.size(), expected.outliers.size()) << offset_sigma;
    (correction.rejected_loops.empty() ? held : left_out) = true;
    for (const auto& [id, T] : correction.T_map_camera)
      EXPECT_LT(geometry::local(expected.T_map_node[id - 1], T).norm(), 1e-3 * sigma_m);
    EXPECT_NEAR(correction.summary.cost_before, optimization::cost(graph, graph.T_map_node), 1e-9);
  }
  EXPECT_TRUE(held);
  EXPECT_TRUE(left_out);
}

TEST_F(LoopCloserTest, NothingIsKnownAtFirst) {
  EXPECT_TRUE(closer_.detect(1).candidates.empty());
  const auto frame = std::make_shared<features::FrameFeatures>();
  EXPECT_TRUE(closer_.detect_lost(frame).candidates.empty());
  EXPECT_FALSE(closer_.relocalise({}));
  EXPECT_FALSE(closer_.consider(1, {}));
}

}  // namespace
}  // namespace camvox::loop
