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

}  // namespace
}  // namespace camvox::tracking
