#include <random>

#include "tracker_fixture.hpp"

namespace camvox::tracking {
namespace {

TEST_F(TrackerTest, AsksForItsPlaceAndTakesTheAnswer) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  TunnelWorld elsewhere(99);
  // Kidnapped to where nothing is known.
  std::swap(world_, elsewhere);
  step(at(0.0));
  EXPECT_EQ(result_.state, TrackingState::kLost);
  ASSERT_TRUE(result_.relocalisation_request);
  EXPECT_EQ(result_.relocalisation_request->landmark_ids.size(),
            result_.relocalisation_request->features.size());
  const auto lost_id = frame_id_;
  step(at(0.5));
  EXPECT_FALSE(result_.relocalisation_request) << "asks only every few frames";
  // An answer to another frame counts for nothing.
  tracker_->relocalise({lost_id + 7, 0, 3, SE3()});
  EXPECT_EQ(tracker_->state(), TrackingState::kLost);
  tracker_->relocalise({lost_id, 0, 1, at(2.0) * TunnelWorld::T_body_camera()});
  EXPECT_EQ(tracker_->state(), TrackingState::kRelocalising);
  std::swap(world_, elsewhere);
  step(at(2.1));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_LT(error_m(at(2.1)), 0.05);
}

// Seen from elsewhere or in other light nothing looks enough like the map to be found among all
// features of an image. Where the place was proposed, its pose tells where each must be.
TEST_F(TrackerTest, AtAProposedPlaceThePoseTellsWhereToLook) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  const auto step_in_other_light = [this](const SE3& T_world_body) {
    auto frame = world_.see(T_world_body * TunnelWorld::T_body_camera(), ++frame_id_, now_ns_);
    std::mt19937 random(static_cast<unsigned>(frame_id_));
    for (auto& descriptor : frame.features.descriptors) {
      for (int bit = 0; bit < 70; ++bit) {
        descriptor.bytes[random() % 32] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      }
    }
    now_ns_ += kFrame_ns;
    result_ = tracker_->track(std::move(frame));
  };
  step_blind();
  for (int i = 0; i < 10; ++i) {
    step_in_other_light(at(2.0));
    ASSERT_EQ(result_.state, TrackingState::kLost) << "found by looks alone";
    if (result_.relocalisation_request) break;
  }
  ASSERT_TRUE(result_.relocalisation_request);
  tracker_->relocalise({frame_id_, 0, 1, at(2.0) * TunnelWorld::T_body_camera()});
  step_in_other_light(at(2.1));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_LT(error_m(at(2.1)), 0.05);
}

// Loop closing answers in the map that it has just corrected; tracking gets that map later.
TEST_F(TrackerTest, AProposalInAMapThatIsYetToComeIsNotCorrectedAgain) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  TunnelWorld elsewhere(99);
  std::swap(world_, elsewhere);
  ASSERT_TRUE(step(at(2.0)).relocalisation_request);
  const SE3 T_new_old(SO3::exp({0.0, 0.0, 0.1}), {0.0, 5.0, 0.0});
  const SE3 T_map_body = T_new_old * at(2.0);
  tracker_->relocalise({frame_id_, 1, 1, T_map_body * TunnelWorld::T_body_camera()});
  std::swap(world_, elsewhere);
  for (int i = 0; i < 15; ++i) {
    step(at(2.0));
    ASSERT_EQ(result_.state, TrackingState::kRelocalising) << "the old map says nothing of it";
  }
  tracker_->update_map(corrected_map(T_new_old));
  step_blind();
  EXPECT_EQ(result_.state, TrackingState::kRelocalising);
  EXPECT_LT(error_m(T_map_body), 1e-9);
  step(at(2.0));
  EXPECT_EQ(result_.state, TrackingState::kTracking);
  EXPECT_EQ(result_.map_epoch, 1U);
  EXPECT_LT(error_m(T_map_body), 0.05);
}

TEST_F(TrackerTest, AsksAgainIfTheMapOfAProposalDoesNotCome) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  world_ = TunnelWorld(99);
  ASSERT_TRUE(step(at(2.0)).relocalisation_request);
  tracker_->relocalise({frame_id_, 1, 1, at(2.0) * TunnelWorld::T_body_camera()});
  int frames = 0;
  while (++frames < 100 && !step(at(2.0)).relocalisation_request) {
  }
  EXPECT_GT(frames, 20);
  EXPECT_LT(frames, 100);
}

TEST_F(TrackerTest, AWrongPlaceIsNotTaken) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  world_ = TunnelWorld(99);
  ASSERT_TRUE(step(at(2.0)).relocalisation_request);
  tracker_->relocalise({frame_id_, 0, 1, at(2.0) * TunnelWorld::T_body_camera()});
  for (int i = 1; i <= 10; ++i) {
    step(at(2.0 + 0.1 * i));
    EXPECT_EQ(result_.state, TrackingState::kRelocalising) << i;
  }
  step(at(3.1));
  EXPECT_EQ(result_.state, TrackingState::kLost);
}

// A tracker that was started anew while mapping lives on founds a map before it hears of the one
// that is there, in which its first keyframe is another. 20 m from the origin: with the place
// proposed, then with looks alone.
TEST_F(TrackerTest, StartedAnewItFindsItsPlaceInTheMapThatIsThere) {
  for (const bool with_answers : {true, false}) {
    world_ = TunnelWorld();
    start();
    for (int i = 0; i <= 40; ++i) step(at(0.5 * i));
    const auto newest = map_->poses().rbegin()->first;
    tracker_.emplace(TrackerConfig(), world_.camera(), TunnelWorld::T_body_camera());
    step(at(20.0));
    EXPECT_EQ(tracker_->state(), TrackingState::kLost) << "what it founded is worth nothing";
    int lost = 0;
    for (int i = 0; i <= 60; ++i) {
      const SE3 T = at(i < 30 ? 20.0 : 20.0 + 0.1 * (i - 30));
      step(T);
      lost += result_.has_pose() ? 0 : 1;
      ASSERT_LT(result_.has_pose() ? error_m(T) : 0.0, 0.1) << i;
      EXPECT_GT(result_.keyframe ? result_.keyframe->id : newest + 1, newest);
      if (!with_answers || !result_.relocalisation_request) continue;
      tracker_->relocalise({frame_id_, 0, newest, at(20.0) * TunnelWorld::T_body_camera()});
    }
    EXPECT_TRUE(result_.has_pose());
    EXPECT_LE(lost, 1) << with_answers;
    EXPECT_EQ(result_.statistics.refused_poses, 0) << with_answers;
  }
}

// The same in a map of a single keyframe, which has the id and the pose of the one just made.
TEST_F(TrackerTest, StartedAnewItKnowsAnotherKeyframeOneByItsLandmarks) {
  start();
  step(at(0.0));
  tracker_.emplace(TrackerConfig(), world_.camera(), TunnelWorld::T_body_camera());
  step(at(3.0));
  for (int i = 0; i < 10; ++i) {
    step(at(3.0));
    ASSERT_TRUE(result_.has_pose()) << i;
    ASSERT_LT(error_m(at(3.0)), 0.1) << i;
  }
}

// What is wrong with the last pose says nothing of the speed: a place was proposed wrongly, then
// the right one is found by looks, 8 m from there.
TEST_F(TrackerTest, TheStepFromAWrongProposalIsNoSpeed) {
  start();
  for (int i = 0; i <= 20; ++i) step(at(0.5 * i));
  TunnelWorld elsewhere(99);
  std::swap(world_, elsewhere);
  ASSERT_TRUE(step(at(2.0)).relocalisation_request);
  tracker_->relocalise({frame_id_, 0, 1, at(2.0) * TunnelWorld::T_body_camera()});
  for (int i = 0; i <= 10; ++i) step(at(2.0));
  ASSERT_EQ(result_.state, TrackingState::kLost);
  std::swap(world_, elsewhere);
  for (int i = 0; i < 10; ++i) {
    step(at(10.0));
    ASSERT_TRUE(result_.has_pose()) << i;
    ASSERT_LT(error_m(at(10.0)), 0.05) << i;
  }
}

}  // namespace
}  // namespace camvox::tracking
