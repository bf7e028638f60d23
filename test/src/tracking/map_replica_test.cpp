#include "camvox/tracking/map_replica.hpp"

#include <gtest/gtest.h>

namespace camvox::tracking {
namespace {

using geometry::SE3;
using geometry::SO3;

constexpr optimization::PinholeCamera kCamera{500.0, 500.0, 320.0, 240.0, 0.05};

Landmark landmark(LandmarkId id, double x_m) {
  Landmark landmark;
  landmark.id = id;
  landmark.p_map = {x_m, 0.0, 0.0};
  landmark.f_map = {1.0F, 0.0F, 0.0F};
  return landmark;
}

LocalMap local_map(std::uint64_t frame_id,
                   std::uint64_t epoch,
                   const std::vector<LandmarkId>& ids) {
  LocalMap map;
  map.frame_id = frame_id;
  map.map_epoch = epoch;
  map.keyframes = {{1, SE3()}};
  map.next_keyframe_id = 2;
  for (const auto id : ids) map.landmarks.push_back(landmark(id, static_cast<double>(id)));
  return map;
}

/// Two features: a new landmark with depth 4 m, and a known landmark.
Keyframe keyframe(KeyframeId id, std::uint64_t frame_id) {
  Keyframe keyframe;
  keyframe.id = id;
  keyframe.frame_id = frame_id;
  keyframe.parent_id = 1;
  keyframe.T_parent_camera = SE3(SO3(), {0.0, 0.0, 1.0});
  keyframe.T_map_camera = keyframe.T_parent_camera;
  keyframe.features.key_points.resize(2);
  keyframe.features.undistorted_px = {{320.0F, 240.0F}, {100.0F, 100.0F}};
  keyframe.features.descriptors.resize(2);
  keyframe.features.depth_m = {4.0F, 5.0F};
  keyframe.features.depth_sigma_m = {0.02F, 0.02F};
  keyframe.landmark_ids = {landmark_id(id, 0), 77};
  return keyframe;
}

class MapReplicaTest : public testing::Test {
 protected:
  MapReplica replica_{kCamera, ScaleLevels()};
};

TEST_F(MapReplicaTest, IsEmptyAtFirst) {
  EXPECT_TRUE(replica_.empty());
  EXPECT_FALSE(replica_.find(1));
  EXPECT_FALSE(replica_.T_map_keyframe(1));
  EXPECT_EQ(replica_.next_keyframe_id(), 1U);
  EXPECT_FALSE(replica_.apply(LocalMap()));
}

TEST_F(MapReplicaTest, NewLandmarksAreThereAtOnceAndStayUntilMappingHasThem) {
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {5, 77})));
  replica_.add(keyframe(2, 12));
  EXPECT_EQ(replica_.landmarks().size(), 3U);
  const auto own = replica_.find(landmark_id(2, 0));
  ASSERT_TRUE(own);
  EXPECT_LT((replica_.landmarks()[*own].p_map - Eigen::Vector3d(0.0, 0.0, 5.0)).norm(), 1e-12);
  EXPECT_EQ(replica_.next_keyframe_id(), 3U);
  EXPECT_EQ(replica_.pending_count(), 1U);

  // Mapping is one frame behind: the keyframe is not in its map yet.
  ASSERT_TRUE(replica_.apply(local_map(11, 0, {5, 77})));
  EXPECT_TRUE(replica_.find(landmark_id(2, 0)));
  EXPECT_TRUE(replica_.T_map_keyframe(2));
  // It has seen the keyframe's frame, but the keyframe was lost on the way.
  ASSERT_TRUE(replica_.apply(local_map(12, 0, {5, 77})));
  EXPECT_TRUE(replica_.find(landmark_id(2, 0)));
  // Now it has the keyframe, and dropped what it founded.
  LocalMap with_keyframe = local_map(13, 0, {5, 77});
  with_keyframe.next_keyframe_id = 3;
  ASSERT_TRUE(replica_.apply(with_keyframe));
  EXPECT_FALSE(replica_.find(landmark_id(2, 0)));
  EXPECT_EQ(replica_.pending_count(), 0U);
}

TEST_F(MapReplicaTest, PendingKeyframesMoveWithTheirParent) {
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {5})));
  replica_.add(keyframe(2, 12));
  LocalMap moved = local_map(11, 1, {5});
  const SE3 T_new_old(SO3::exp({0.0, 0.2, 0.0}), {1.0, 2.0, 3.0});
  moved.keyframes[0].T_map_camera = T_new_old;
  ASSERT_TRUE(replica_.apply(moved));
  const Eigen::Vector3d p_map = replica_.landmarks()[*replica_.find(landmark_id(2, 0))].p_map;
  EXPECT_LT((p_map - T_new_old * Eigen::Vector3d(0.0, 0.0, 5.0)).norm(), 1e-12);
  EXPECT_LT(
      geometry::local(*replica_.T_map_keyframe(2), T_new_old * SE3(SO3(), {0.0, 0.0, 1.0})).norm(),
      1e-12);
}

// Each keyframe is taken from the one before, 1 m further on.
TEST_F(MapReplicaTest, OfTooManyPendingKeyframesTheOlderHalfIsThinnedOut) {
  const auto add = [this](KeyframeId id) {
    auto own = keyframe(id, 10 * id);
    own.parent_id = id - 1;
    own.T_map_camera = SE3(SO3(), {0.0, 0.0, static_cast<double>(id - 1)});
    replica_.add(own);
  };
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {5})));
  for (KeyframeId id = 2; id <= 11; ++id) add(id);
  EXPECT_EQ(replica_.thin_out(11), std::nullopt);
  EXPECT_EQ(replica_.thin_out(10), 3U);
  EXPECT_EQ(replica_.pending_count(), 9U);
  EXPECT_FALSE(replica_.T_map_keyframe(3));
  EXPECT_FALSE(replica_.find(landmark_id(3, 0)));
  EXPECT_TRUE(replica_.find(landmark_id(4, 0)));
  add(12);
  EXPECT_EQ(replica_.thin_out(10), 5U) << "without 4 the gap would be larger";
  for (KeyframeId id = 13; id <= 100; ++id) {
    add(id);
    ASSERT_TRUE(replica_.thin_out(10)) << id;
  }
  for (const KeyframeId id : {2, 97, 98, 99, 100}) EXPECT_TRUE(replica_.T_map_keyframe(id)) << id;
  EXPECT_EQ(replica_.landmarks().size(), 1U + replica_.pending_count());

  // They are one piece still.
  LocalMap moved = local_map(11, 1, {5});
  const SE3 T_new_old(SO3::exp({0.0, 0.2, 0.0}), {1.0, 2.0, 3.0});
  moved.keyframes[0].T_map_camera = T_new_old;
  ASSERT_TRUE(replica_.apply(moved));
  for (const auto& [id, T_map_camera] : replica_.keyframes()) {
    const SE3 T_old(SO3(), {0.0, 0.0, static_cast<double>(id - 1)});
    EXPECT_LT(geometry::local(T_map_camera, T_new_old * T_old).norm(), 1e-9) << id;
  }
}

TEST_F(MapReplicaTest, OfAFewPendingKeyframesNoneGoes) {
  for (KeyframeId id = 1; id <= 3; ++id) replica_.add(keyframe(id, id));
  EXPECT_EQ(replica_.thin_out(0), std::nullopt);
}

TEST_F(MapReplicaTest, OlderMapsAreIgnored) {
  ASSERT_TRUE(replica_.apply(local_map(10, 1, {5})));
  EXPECT_FALSE(replica_.apply(local_map(9, 1, {6})));
  EXPECT_FALSE(replica_.apply(local_map(11, 0, {6})));
  EXPECT_TRUE(replica_.find(5));
}

TEST_F(MapReplicaTest, AMapThatWasRestartedIsIgnoredUntilItHasCaughtUp) {
  LocalMap whole = local_map(10, 0, {5});
  whole.next_keyframe_id = 7;
  ASSERT_TRUE(replica_.apply(whole));
  EXPECT_FALSE(replica_.apply(local_map(11, 0, {6})));
  EXPECT_TRUE(replica_.find(5));
  whole.frame_id = 12;
  EXPECT_TRUE(replica_.apply(whole));
}

TEST_F(MapReplicaTest, AMapWithKeyframesThatWereNeverMadeIsForeign) {
  LocalMap map = local_map(10, 0, {5});
  map.keyframes.push_back({2, SE3()});
  map.next_keyframe_id = 3;
  EXPECT_FALSE(replica_.is_foreign(map)) << "nothing is here";
  replica_.add(keyframe(1, 9));
  EXPECT_FALSE(replica_.is_foreign(LocalMap()));
  EXPECT_TRUE(replica_.is_foreign(map));
  replica_.add(keyframe(2, 10));
  EXPECT_FALSE(replica_.is_foreign(map));
}

// The looks of the landmark that keyframe 1 founded, of which mapping may have seen more.
TEST_F(MapReplicaTest, AMapWithOtherLandmarksUnderTheSameIdsIsForeign) {
  replica_.add(keyframe(1, 9));
  LocalMap map = local_map(10, 0, {landmark_id(1, 0), landmark_id(1, 1)});
  EXPECT_FALSE(replica_.is_foreign(map));
  map.landmarks[0].descriptor.bytes.fill(0x11);  // 64 bits of 256: another view
  EXPECT_FALSE(replica_.is_foreign(map));
  map.landmarks[0].descriptor.bytes.fill(0x55);  // 128 bits: another point
  EXPECT_TRUE(replica_.is_foreign(map));
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {landmark_id(1, 0)})));
  EXPECT_FALSE(replica_.is_foreign(map)) << "mapping had the keyframe: its landmarks are its own";
}

TEST_F(MapReplicaTest, BansWhatDisagreesAndRemembersItFromMapToMap) {
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {5, 6, 7})));
  const auto index = *replica_.find(6);
  replica_.judge(index, false);
  replica_.judge(index, true);  // an agreement makes up for half a disagreement
  replica_.judge(index, false);
  EXPECT_FALSE(replica_.is_banned(index));
  replica_.judge(index, false);
  replica_.judge(index, false);
  EXPECT_TRUE(replica_.is_banned(index));
  ASSERT_TRUE(replica_.apply(local_map(11, 0, {1, 2, 6, 9})));
  EXPECT_TRUE(replica_.is_banned(*replica_.find(6)));
  EXPECT_EQ(replica_.banned_count(), 1);
}

TEST_F(MapReplicaTest, ABanEndsWithTheFramesAndComesBackAtTheNextDisagreement) {
  ASSERT_TRUE(replica_.apply(local_map(10, 0, {5, 6})));
  const auto index = *replica_.find(6);
  for (int i = 0; i < 3; ++i) replica_.judge(index, false);
  for (int frame = 1; frame < 20; ++frame) replica_.age_bans();
  EXPECT_TRUE(replica_.is_banned(index));
  replica_.age_bans();
  EXPECT_FALSE(replica_.is_banned(index));
  replica_.age_bans();  // no more than the ban is forgotten
  replica_.judge(index, false);
  EXPECT_TRUE(replica_.is_banned(index));
  for (int frame = 0; frame < 20; ++frame) replica_.age_bans();
  replica_.judge(index, true);
  replica_.judge(index, true);
  replica_.judge(index, false);
  EXPECT_FALSE(replica_.is_banned(index)) << "what agrees wins its place back";
}

}  // namespace
}  // namespace camvox::tracking
