#include "camvox/loop_closing/loop_closing_component.hpp"

#include <gmock/gmock.h>

#include <thread>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/test/feature_world.hpp"
#include "camvox/test/there_and_back.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::LoopCorrection;
using camvox_interfaces::msg::MapUpdate;
using camvox_interfaces::msg::Progress;
using camvox_interfaces::msg::RelocalisationAnswer;
using geometry::SE3;
using test::on_circle;

constexpr double kRadius_m = 15.0;
constexpr std::size_t kRound = 94;  // keyframes, one a metre

/// Drives around a circle and on; tracking's and mapping's messages come from here.
class LoopClosingComponentTest : public testing::Test {
 protected:
  LoopClosingComponentTest() {
    for (int i = 0; i < 50; ++i) {
      const double angle = i * 2.0 * M_PI / 50.0;
      world_.add_box(60, on_circle(angle, kRadius_m).translation(), {8.0, 5.0, 8.0});
    }
    fake_.set_parameter("camera.fx_px", config::Value(world_.camera.fx_px));
    fake_.set_parameter("camera.fy_px", config::Value(world_.camera.fy_px));
    fake_.set_parameter("camera.cx_px", config::Value(world_.camera.cx_px));
    fake_.set_parameter("camera.cy_px", config::Value(world_.camera.cy_px));
  }

  void make(bool lockstep) {
    fake_.set_parameter("lockstep", config::Value(lockstep));
    component_ = std::make_unique<LoopClosingComponent>(fake_);
    component_->start();
  }

  static SE3 truth(std::size_t i) {
    return on_circle(static_cast<double>(i) / kRadius_m, kRadius_m);
  }

  tracking::Keyframe keyframe(std::size_t i) {
    tracking::Keyframe keyframe;
    keyframe.id = i + 1;
    keyframe.frame_id = 10 * (i + 1);
    keyframe.parent_id = i;
    keyframe.features = world_.look(truth(i), 12.0);
    keyframe.landmark_ids.assign(keyframe.features.size(), 0);
    keyframe.T_map_camera = truth(i);
    if (i > 0) {
      const SE3 drift(geometry::SO3::exp({0.0, 6e-4, 0.0}), {0.0, 0.0, 0.004});
      keyframe.T_map_camera = last_ * truth(i - 1).inverse() * truth(i) * drift;
    }
    last_ = keyframe.T_map_camera;
    return keyframe;
  }

  void send_keyframe(const std::string& port, const tracking::Keyframe& keyframe) {
    fake_.send<Keyframe>(port, [&](Keyframe& message) {
      ASSERT_TRUE(conversion::write_keyframe(keyframe, message));
    });
  }

  void send_update(std::uint64_t epoch, std::uint64_t frame_id, std::uint64_t id, const SE3& T) {
    fake_.send<MapUpdate>("map_update", [&](MapUpdate& message) {
      message.header().frame_id(frame_id);
      message.map_epoch(epoch);
      message.keyframe_ids()[0] = id;
      message.keyframe_poses()[0] = conversion::to_array(T);
      message.keyframe_ids_count(1);
      message.keyframe_poses_count(1);
    });
  }

  void drive(std::size_t i, std::uint64_t epoch = 0) {
    const auto next = keyframe(i);
    if (i % 2 == 0) send_keyframe("keyframe", next);
    send_update(epoch, next.frame_id, next.id, next.T_map_camera);
    if (i % 2 != 0) send_keyframe("keyframe", next);
  }

  [[nodiscard]] auto corrections() const {
    return fake_.published<LoopCorrection>("loop_correction");
  }

  [[nodiscard]] std::shared_ptr<const LoopCorrection> first_loop() const {
    for (const auto& correction : corrections()) {
      if (correction->keyframe_ids_count() > 0) return correction;
    }
    return nullptr;
  }

  test::FeatureWorld world_;
  FakeContext fake_;
  std::unique_ptr<LoopClosingComponent> component_;
  SE3 last_;
};

TEST_F(LoopClosingComponentTest, AnswersEveryKeyframeAndClosesTheLoop) {
  make(true);
  for (std::size_t i = 0; i < kRound + 10; ++i) drive(i);
  const auto answers = corrections();
  ASSERT_EQ(answers.size(), kRound + 10);
  for (std::size_t i = 0; i < answers.size(); ++i) {
    EXPECT_EQ(answers[i]->header().frame_id(), 10 * (i + 1));
  }
  const auto loop = first_loop();
  ASSERT_NE(loop, nullptr);
  EXPECT_GT(loop->query_keyframe_id(), kRound - 8);  // the beginning is seen from afar
  EXPECT_LT(loop->match_keyframe_id(), 15U);
  EXPECT_EQ(loop->by_surfaces(), 0);
  EXPECT_EQ(loop->keyframe_ids_count(), loop->query_keyframe_id());
  const auto T = conversion::to_se3(loop->T_match_query());
  const SE3 T_true =
      truth(loop->match_keyframe_id() - 1).inverse() * truth(loop->query_keyframe_id() - 1);
  EXPECT_LT(geometry::local(T_true, T).norm(), 0.05);
  const auto corrected = conversion::to_se3(loop->keyframe_poses()[loop->query_keyframe_id() - 1]);
  const auto error_m = [&](const SE3& pose) {
    return (pose.translation() - truth(loop->query_keyframe_id() - 1).translation()).norm();
  };
  EXPECT_LT(error_m(corrected), 0.3);
  EXPECT_EQ(fake_.published<Progress>("keyframe_progress").size(), kRound + 10);
  fake_.verify_nothing_left();
}

TEST_F(LoopClosingComponentTest, TheWorkerFindsTheSame) {
  make(false);
  for (std::size_t i = 0; i < kRound + 10; ++i) {
    drive(i);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (corrections().size() <= i && std::chrono::steady_clock::now() < deadline) {
      fake_.run_posted(std::chrono::milliseconds(100));
    }
    ASSERT_EQ(corrections().size(), i + 1);
  }
  EXPECT_NE(first_loop(), nullptr);
  component_->stop();
}

// The map is corrected by another loop while a pose graph is solved: poses of the old map must not
// be used.
TEST_F(LoopClosingComponentTest, AnOutdatedCorrectionIsNotSent) {
  make(false);
  bool outdated = false;
  for (std::size_t i = 0; i < kRound + 10 && !outdated; ++i) {
    drive(i);
    // Until the places are verified; without any the answer is there at once.
    while (corrections().size() <= i && fake_.run_posted(std::chrono::milliseconds(100)) == 0) {
    }
    if (corrections().size() > i) continue;
    outdated = true;  // the graph is being solved
    send_update(1, 10 * (i + 1), i + 1, last_);
    while (corrections().size() <= i) fake_.run_posted(std::chrono::milliseconds(100));
    EXPECT_EQ(corrections().back()->map_epoch(), 1U);
    EXPECT_EQ(corrections().back()->keyframe_ids_count(), 0U);
  }
  ASSERT_TRUE(outdated);
  EXPECT_EQ(first_loop(), nullptr);
  component_->stop();
}

TEST_F(LoopClosingComponentTest, TellsALostTrackerWhereItIs) {
  make(true);
  for (std::size_t i = 0; i < 40; ++i) drive(i);
  tracking::Keyframe lost;
  lost.frame_id = 777;
  const SE3 T = truth(20) * SE3(geometry::SO3::exp({0.0, 0.05, 0.0}), {0.2, 0.0, 0.1});
  lost.features = world_.look(T, 12.0);
  lost.landmark_ids.assign(lost.features.size(), 0);
  send_keyframe("relocalisation_request", lost);
  lost.features = test::FeatureWorld(5).look(T);  // nothing
  lost.landmark_ids.clear();
  send_keyframe("relocalisation_request", lost);
  const auto answers = fake_.published<RelocalisationAnswer>("relocalisation_answer");
  ASSERT_EQ(answers.size(), 2U);
  EXPECT_EQ(answers[0]->found(), 1);
  EXPECT_EQ(answers[0]->header().frame_id(), 777U);
  ASSERT_GT(answers[0]->keyframe_ids_count(), 1U);
  EXPECT_NEAR(static_cast<double>(answers[0]->keyframe_ids()[0]), 21.0, 4.0);
  EXPECT_EQ(answers[1]->found(), 0);
  EXPECT_EQ(answers[1]->keyframe_ids_count(), 0U);
}

TEST_F(LoopClosingComponentTest, RelocalisesInALoadedMap) {
  make(true);
  for (std::size_t i = 0; i < 30; ++i) send_keyframe("map_keyframe", keyframe(i));
  ASSERT_EQ(corrections().size(), 30U);
  for (std::size_t i = 0; i < 30; ++i) {  // acknowledgments
    EXPECT_EQ(corrections()[i]->header().frame_id(), 0U);
    EXPECT_EQ(corrections()[i]->query_keyframe_id(), i + 1);
    EXPECT_EQ(corrections()[i]->keyframe_ids_count(), 0U);
  }
  auto lost = keyframe(12);
  send_keyframe("relocalisation_request", lost);
  EXPECT_EQ(fake_.published<RelocalisationAnswer>("relocalisation_answer").at(0)->found(), 1);
}

// Its ends show nothing in common; mapping must know, or it would look for what to fuse.
TEST_F(LoopClosingComponentTest, ClosesAWayBackBySurfaces) {
  using test::ThereAndBack;
  make(true);
  ThereAndBack world(test::SurfaceScene::street(ThereAndBack::kLength_m));
  for (std::size_t i = 0; i < ThereAndBack::kKeyframes && first_loop() == nullptr; ++i) {
    const auto next = world.keyframe(i, last_);
    last_ = next.T_map_camera;
    send_keyframe("keyframe", next);
    fake_.send<MapUpdate>("map_update", [&](MapUpdate& message) {
      message.header().frame_id(next.frame_id);
      message.keyframe_ids()[0] = next.id;
      message.keyframe_poses()[0] = conversion::to_array(next.T_map_camera);
      message.keyframe_ids_count(1);
      message.keyframe_poses_count(1);
      std::uint32_t edges = 0;
      for (std::size_t k = ThereAndBack::first_neighbour(i); k < i; ++k) {
        message.edges()[edges++] = {k + 1, next.id, 50};
      }
      message.edges_count(edges);
    });
  }
  const auto loop = first_loop();
  ASSERT_NE(loop, nullptr);
  EXPECT_EQ(loop->by_surfaces(), 1);
  const auto T_true = ThereAndBack::truth(loop->match_keyframe_id() - 1).inverse() *
                      ThereAndBack::truth(loop->query_keyframe_id() - 1);
  const auto error = geometry::local(T_true, conversion::to_se3(loop->T_match_query()));
  EXPECT_LT(error.tail<3>().norm(), 0.3);
  EXPECT_LT(error.head<3>().norm(), 0.02);
}

TEST_F(LoopClosingComponentTest, RefusesAWrongConfig) {
  fake_.set_parameter("loop.verification.max_ratio", config::Value(2.0));
  EXPECT_THROW(LoopClosingComponent{fake_}, config::ConfigError);
}

}  // namespace
}  // namespace camvox
