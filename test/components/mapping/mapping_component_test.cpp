#include "camvox/mapping_component/mapping_component.hpp"

#include <gmock/gmock.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/mapping/map_file.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FramePose;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::LocalMap;
using camvox_interfaces::msg::LoopCorrection;
using camvox_interfaces::msg::MapUpdate;
using camvox_interfaces::msg::Progress;
using geometry::SE3;
using ::testing::HasSubstr;

constexpr std::size_t kPoints = 200;

/// Points on a rough wall 10 m ahead, seen exactly by a camera that moves to the right.
class MappingTest : public testing::Test {
 protected:
  MappingTest() {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (std::size_t i = 0; i < kPoints; ++i) {
      points_map_.emplace_back(4.0 * unit(random), 1.5 * unit(random), 10.0 + unit(random));
      for (auto& byte : descriptors_.emplace_back().bytes) {
        byte = static_cast<std::uint8_t>(random());
      }
    }
  }

  [[nodiscard]] static SE3 camera_at(double x_m) { return {geometry::SO3(), {x_m, 0.0, 0.0}}; }

  /// Keyframe `id` of frame `id`; the first founds all landmarks, the others see them again.
  [[nodiscard]] tracking::Keyframe keyframe(std::uint64_t id, double x_m) const {
    const sensors::CameraIntrinsics camera;
    tracking::Keyframe result;
    result.id = result.frame_id = id;
    result.stamp_ns = static_cast<std::int64_t>(id) * 1'000'000'000;
    result.parent_id = id - 1;
    result.T_map_camera = camera_at(x_m);
    result.T_parent_camera = id == 1 ? SE3() : camera_at(0.3);
    for (std::size_t i = 0; i < kPoints; ++i) {
      const Eigen::Vector3d p = points_map_[i] - result.T_map_camera.translation();
      const Eigen::Vector2f u_px(static_cast<float>(camera.fx_px * p.x() / p.z() + camera.cx_px),
                                 static_cast<float>(camera.fy_px * p.y() / p.z() + camera.cy_px));
      result.features.key_points.push_back({u_px.x(), u_px.y(), 0.0F, 50.0F, 0});
      result.features.undistorted_px.push_back(u_px);
      result.features.descriptors.push_back(descriptors_[i]);
      result.features.depth_m.push_back(static_cast<float>(p.z()));
      result.features.depth_sigma_m.push_back(0.02F);
      result.landmark_ids.push_back(tracking::landmark_id(1, i));
    }
    return result;
  }

  void send_keyframe(std::uint64_t id, double x_m, const char* port = "keyframe") {
    fake_.send<Keyframe>(port, [&](Keyframe& message) {
      ASSERT_TRUE(conversion::write_keyframe(keyframe(id, x_m), message));
    });
  }
  void send_pose(std::uint64_t frame_id, std::uint64_t reference_id, std::uint64_t epoch = 0) {
    FramePose pose;
    pose.map_epoch(epoch);
    pose.header().frame_id(frame_id);
    pose.reference_keyframe_id(reference_id);
    fake_.send("frame_pose", pose);
  }
  void send_correction(std::uint64_t frame_id,
                       const std::vector<std::pair<std::uint64_t, double>>& x_m) {
    fake_.send<LoopCorrection>("loop_correction", [&](LoopCorrection& correction) {
      correction.header().frame_id(frame_id);
      correction.query_keyframe_id(frame_id);
      correction.match_keyframe_id(1);
      std::uint32_t count = 0;
      for (const auto& [id, x] : x_m) {
        correction.keyframe_ids()[count] = id;
        correction.keyframe_poses()[count++] = conversion::to_array(camera_at(x));
      }
      correction.keyframe_ids_count(count);
      correction.keyframe_poses_count(count);
    });
  }
  [[nodiscard]] std_srvs::srv::Trigger_Response call_save() {
    return fake_.call<std_srvs::srv::Trigger_Request, std_srvs::srv::Trigger_Response>("save_map",
                                                                                       {});
  }
  [[nodiscard]] std::vector<std::shared_ptr<const LocalMap>> maps() const {
    return fake_.published<LocalMap>("local_map");
  }
  [[nodiscard]] std::string log() const {
    std::string text;
    for (const auto& entry : fake_.log_entries()) text += entry.text + "\n";
    return text;
  }

  std::vector<Eigen::Vector3d> points_map_;
  std::vector<features::Descriptor> descriptors_;
  FakeContext fake_;
};

TEST_F(MappingTest, AnswersEveryPoseWithTheMapAroundItsKeyframe) {
  fake_.set_parameter("lockstep", true);
  MappingComponent mapping(fake_);
  mapping.start();
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  send_pose(2, 1);
  ASSERT_EQ(maps().size(), 2U);
  EXPECT_EQ(maps()[1]->header().frame_id(), 2U);
  const auto map = conversion::read_local_map(*maps()[1]);
  EXPECT_EQ(map.reference_keyframe_id, 1U);
  EXPECT_EQ(map.next_keyframe_id, 2U);
  ASSERT_EQ(map.landmarks.size(), kPoints);
  EXPECT_LT((map.landmarks[7].p_map - points_map_[7]).norm(), 1e-4);
  EXPECT_EQ(fake_.published<Progress>("progress").size(), 2U);
  mapping.stop();
}

TEST_F(MappingTest, APoseWaitsForTheKeyframeThatItRefersTo) {
  fake_.set_parameter("lockstep", true);
  MappingComponent mapping(fake_);
  mapping.start();
  send_pose(1, 1);
  EXPECT_TRUE(maps().empty());
  send_keyframe(1, 0.0);
  EXPECT_EQ(maps().size(), 1U);
  mapping.stop();
}

TEST_F(MappingTest, TellsPosesAndEdgesThatChanged) {
  fake_.set_parameter("lockstep", true);
  MappingComponent mapping(fake_);
  mapping.start();
  for (const std::uint64_t id : {1U, 2U, 3U}) {
    send_keyframe(id, 0.3 * static_cast<double>(id - 1));
    send_pose(id, id);
  }
  std::set<std::uint64_t> told;
  bool edge_1_2 = false;
  for (const auto& update : fake_.published<MapUpdate>("map_update")) {
    for (std::uint32_t i = 0; i < update->keyframe_ids_count(); ++i) {
      told.insert(update->keyframe_ids()[i]);
    }
    for (std::uint32_t i = 0; i < update->edges_count(); ++i) {
      const auto& edge = update->edges()[i];
      edge_1_2 = edge_1_2 || (edge[0] == 1 && edge[1] == 2 && edge[2] > 100);
    }
  }
  EXPECT_EQ(told, (std::set<std::uint64_t>{1, 2, 3}));
  EXPECT_TRUE(edge_1_2);
  mapping.stop();
}

TEST_F(MappingTest, InLockstepAKeyframeIsAnsweredAfterLoopClosing) {
  fake_.set_parameter("lockstep", true);
  fake_.set_parameter("wait_for_loop_closing", true);
  MappingComponent mapping(fake_);
  mapping.start();
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  EXPECT_TRUE(maps().empty());
  send_correction(1, {});
  ASSERT_EQ(maps().size(), 1U);
  send_pose(2, 1);
  EXPECT_EQ(maps().size(), 2U) << "no keyframe: nothing to wait for";
  mapping.stop();
}

TEST_F(MappingTest, ACorrectionMovesTheMapAndRaisesTheEpoch) {
  fake_.set_parameter("lockstep", true);
  fake_.set_parameter("mapping.full_bundle_iterations", std::int64_t{0});
  MappingComponent mapping(fake_);
  mapping.start();
  for (const std::uint64_t id : {1U, 2U, 3U}) {
    send_keyframe(id, 0.3 * static_cast<double>(id - 1));
    send_pose(id, id);
  }
  send_correction(3, {{1, 0.0}, {2, 0.35}, {3, 0.7}});
  EXPECT_EQ(mapping.mapper().epoch(), 1U);
  send_pose(4, 3);
  const auto map = conversion::read_local_map(*maps().back());
  EXPECT_EQ(map.map_epoch, 1U);
  ASSERT_EQ(map.keyframes.size(), 3U);
  EXPECT_NEAR(map.keyframes[2].T_map_camera.translation().x(), 0.7, 1e-9);
  mapping.stop();
}

TEST_F(MappingTest, LiveTheAdjustedMapComesFromAThread) {
  MappingComponent mapping(fake_);
  mapping.start();
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  send_keyframe(2, 0.3);
  send_pose(2, 2);
  const std::size_t at_once = maps().size();
  EXPECT_EQ(at_once, 2U) << "poses do not wait for bundle adjustment";
  EXPECT_GE(fake_.run_posted(std::chrono::seconds(20)), 1U);
  EXPECT_GT(maps().size(), at_once);
  EXPECT_THAT(fake_.diagnostics().status().values["local bundle adjustment"], HasSubstr("cost"));
  mapping.stop();
}

TEST_F(MappingTest, AfterLostKeyframesTheNextOnesWaitUntilTheyAreSentAgain) {
  MappingComponent mapping(fake_);
  mapping.start();
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  send_keyframe(5, 1.2);
  for (std::uint64_t frame = 5; frame < 12; ++frame) send_pose(frame, 5);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 1U);
  ASSERT_GE(maps().size(), 2U) << "frames are answered all the same";
  EXPECT_EQ(maps().back()->next_keyframe_id(), 2U) << "which tells what is missing";
  for (const std::uint64_t id : {2U, 3U, 4U}) {
    send_keyframe(id, 0.3 * static_cast<double>(id - 1), "resent_keyframe");
  }
  send_pose(12, 5);
  EXPECT_EQ(maps().back()->next_keyframe_id(), 6U);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 5U);
  const auto updates = fake_.published<MapUpdate>("map_update");
  const auto whole = std::any_of(updates.begin(), updates.end(), [](const auto& update) {
    return update->keyframe_ids_count() == 5;
  });
  EXPECT_TRUE(whole) << "those who were cut off get all of the map";
  mapping.stop();
}

TEST_F(MappingTest, ARestartedMappingTakesOverTheEpochAndAsksForTheFirstKeyframe) {
  MappingComponent mapping(fake_);
  mapping.start();
  for (std::uint64_t frame = 100; frame < 110; ++frame) send_pose(frame, 50, 3);
  ASSERT_FALSE(maps().empty());
  EXPECT_EQ(maps().back()->next_keyframe_id(), 1U);
  EXPECT_EQ(maps().back()->map_epoch(), 3U);
  // The oldest that tracking still has.
  send_keyframe(48, 0.0, "resent_keyframe");
  send_keyframe(49, 0.3, "resent_keyframe");
  send_keyframe(50, 0.6, "resent_keyframe");
  EXPECT_EQ(maps().back()->next_keyframe_id(), 51U);
  mapping.stop();
}

TEST_F(MappingTest, AKeyframeThatIsNeverSentAgainIsGivenUp) {
  MappingComponent mapping(fake_);
  mapping.start();
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  send_keyframe(3, 0.6);
  for (std::uint64_t frame = 3; frame < 80; ++frame) send_pose(frame, 3);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 2U);
  EXPECT_EQ(maps().back()->next_keyframe_id(), 4U);
  mapping.stop();
}

TEST_F(MappingTest, AMalformedKeyframeIsRefusedByName) {
  MappingComponent mapping(fake_);
  mapping.start();
  const auto send_broken = [this] {
    fake_.send<Keyframe>("keyframe", [&](Keyframe& message) {
      ASSERT_TRUE(conversion::write_keyframe(keyframe(9, 0.0), message));
      message.depth_count(3);
    });
  };
  try {
    send_broken();
    FAIL() << "taken";
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), HasSubstr("keyframe 9: lists of different length"));
  }
  mapping.stop();
}

TEST_F(MappingTest, SaysWhenTheMapTakesMoreThanItsBudget) {
  fake_.set_parameter("lockstep", true);
  fake_.set_parameter("keyframe_budget_kb", std::int64_t{30});
  MappingComponent mapping(fake_);
  mapping.start();
  for (const std::uint64_t id : {1U, 2U}) {
    send_keyframe(id, 0.3 * static_cast<double>(id - 1));
    send_pose(id, id);
  }
  fake_.advance(std::chrono::seconds(1));
  // 200 features of 90 bytes, the grid's 12 kB, and 200 landmarks of 200 bytes for both.
  const auto status = fake_.diagnostics().status();
  EXPECT_NEAR(std::stod(status.values.at("kB per keyframe")), 50.0, 15.0);
  EXPECT_EQ(status.level, HealthLevel::kWarn);
  EXPECT_THAT(status.message, HasSubstr("keyframe_budget_kb"));
  mapping.stop();
}

/// The same in a map of three keyframes that an earlier run has saved.
class LoadedMapTest : public MappingTest {
 protected:
  LoadedMapTest() {
    std::filesystem::create_directories(folder_);
    fake_.set_parameter("lockstep", true);
    fake_.set_parameter("load_map", file().string());
    mapping::Mapper mapper({}, tracking::FrameBuilder({}, {}).tracking_camera());
    for (const std::uint64_t id : {1U, 2U, 3U}) {
      mapper.process(keyframe(id, 0.3 * static_cast<double>(id - 1)));
    }
    const auto status = save_map(file(), mapper.map(), 7, mapper.model().camera());
    EXPECT_TRUE(status.ok()) << status.message();
  }
  ~LoadedMapTest() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path file() const { return folder_ / "map.mcap"; }
  [[nodiscard]] std::string bytes() const {
    std::ifstream stream(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] std::vector<std::uint64_t> announced() const {
    std::vector<std::uint64_t> ids;
    for (const auto& each : fake_.published<Keyframe>("map_keyframe")) ids.push_back(each->id());
    return ids;
  }
  /// As loop closing does when it has taken a keyframe in.
  void acknowledge(std::uint64_t id) {
    fake_.send<LoopCorrection>("loop_correction",
                               [id](LoopCorrection& received) { received.query_keyframe_id(id); });
  }
  void acknowledge_all() {
    for (const std::uint64_t id : {1U, 2U, 3U, 1U}) acknowledge(id);
  }
  /// The loaded map's three keyframes are known to all, and tracking makes one more.
  void start_and_send_a_fourth(MappingComponent& mapping) {
    mapping.start();
    acknowledge_all();
    send_keyframe(4, 0.9);
    send_pose(1, 4);
  }

  std::filesystem::path folder_ =
      std::filesystem::path(testing::TempDir()) / ("mapping_" + std::to_string(getpid()));
};

TEST_F(LoadedMapTest, IsAnnouncedAsLoopClosingTakesItIn) {
  MappingComponent mapping(fake_);
  mapping.start();
  EXPECT_EQ(announced(), (std::vector<std::uint64_t>{1, 2, 3}));
  EXPECT_TRUE(fake_.published<MapUpdate>("map_update").empty());
  acknowledge(1);
  acknowledge(2);
  fake_.advance(std::chrono::seconds(2));
  EXPECT_EQ(announced().back(), 3U) << "sent again: it was not acknowledged";
  EXPECT_GT(announced().size(), 3U);
  EXPECT_TRUE(maps().empty()) << "tracking waits until all is known";
  acknowledge(3);
  const auto updates = fake_.published<MapUpdate>("map_update");
  ASSERT_EQ(updates.size(), 1U);
  EXPECT_EQ(updates[0]->map_epoch(), 7U);
  EXPECT_EQ(updates[0]->keyframe_ids_count(), 3U);
  EXPECT_EQ(updates[0]->edges_count(), 3U);
  EXPECT_EQ(announced().back(), 1U) << "the root once more, behind the update";
  acknowledge(1);
  ASSERT_FALSE(maps().empty());
  const auto map = conversion::read_local_map(*maps().back());
  EXPECT_EQ(map.map_epoch, 7U);
  EXPECT_EQ(map.next_keyframe_id, 4U);
  EXPECT_EQ(map.keyframes.size(), 3U);
  mapping.stop();
}

TEST_F(LoadedMapTest, GoesOnWithTheNextId) {
  MappingComponent mapping(fake_);
  start_and_send_a_fourth(mapping);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 4U);
  EXPECT_EQ(conversion::read_local_map(*maps().back()).reference_keyframe_id, 4U);
  mapping.stop();
}

TEST_F(LoadedMapTest, TakesOverTheEpochAfterARestart) {
  MappingComponent mapping(fake_);
  mapping.start();
  acknowledge_all();
  send_pose(100, 3, 9);  // tracking has seen two corrections since
  const auto map = conversion::read_local_map(*maps().back());
  EXPECT_EQ(map.map_epoch, 9U) << "or tracking would not take it";
  const auto update = fake_.published<MapUpdate>("map_update").back();
  EXPECT_EQ(update->map_epoch(), 9U);
  EXPECT_EQ(update->keyframe_ids_count(), 3U);
}

TEST_F(LoadedMapTest, GetsNoSecondMapBesideIt) {
  MappingComponent mapping(fake_);
  mapping.start();
  acknowledge_all();
  fake_.send<Keyframe>("keyframe", [&](Keyframe& message) {
    auto stray = keyframe(4, 0.9);
    stray.parent_id = 0;
    ASSERT_TRUE(conversion::write_keyframe(stray, message));
  });
  send_pose(1, 4);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 3U);
  EXPECT_THAT(log(), HasSubstr("keyframe 4 not taken: it is not tied to the loaded map"));
  EXPECT_EQ(fake_.published<Progress>("progress").size(), 1U) << "the frame is answered anyway";
  mapping.stop();
}

TEST_F(LoadedMapTest, StaysAsItIsForLocalisationOnly) {
  fake_.set_parameter("localisation_only", true);
  fake_.set_parameter("output_dir", folder_.string());
  const auto before = bytes();
  MappingComponent mapping(fake_);
  start_and_send_a_fourth(mapping);
  send_correction(1, {{1, 0.0}, {2, 0.35}, {3, 0.7}});
  send_pose(2, 3);
  EXPECT_EQ(mapping.mapper().map().keyframes().size(), 3U);
  EXPECT_EQ(mapping.mapper().epoch(), 7U);
  EXPECT_EQ(conversion::read_local_map(*maps().back()).keyframes.size(), 3U);
  mapping.stop();
  EXPECT_EQ(bytes(), before);
}

TEST_F(LoadedMapTest, IsSavedAtTheEndAndOnRequest) {
  fake_.set_parameter("output_dir", folder_.string());
  fake_.set_parameter("save_map", false);
  MappingComponent mapping(fake_);
  start_and_send_a_fourth(mapping);
  const auto before = bytes();
  EXPECT_TRUE(fake_.change_parameters({{"save_map", {true, {}}}}).empty());
  const auto after = bytes();
  EXPECT_NE(before, after);
  std::filesystem::remove(file());
  mapping.stop();
  EXPECT_EQ(bytes(), after);
  EXPECT_THAT(log(), HasSubstr("map of 4 keyframes"));
}

TEST_F(LoadedMapTest, IsSavedWhenTheServiceIsCalled) {
  fake_.set_parameter("output_dir", folder_.string());
  fake_.set_parameter("save_map", false);
  MappingComponent mapping(fake_);
  start_and_send_a_fourth(mapping);
  std::filesystem::remove(file());
  const auto saved = call_save();
  EXPECT_TRUE(saved.success());
  EXPECT_EQ(saved.message(), file().string());
  const auto loaded = mapping::load_map(file(), mapping.mapper().model().camera());
  ASSERT_TRUE(loaded.ok()) << loaded.status().message();
  EXPECT_EQ(loaded->map.keyframes().size(), 4U);
}

TEST_F(LoadedMapTest, TheServiceSaysWhyItSavesNothing) {
  fake_.set_parameter("output_dir", (folder_ / "no_such_folder").string());
  MappingComponent mapping(fake_);
  EXPECT_FALSE(call_save().success());
  EXPECT_EQ(call_save().message(), "the map is empty");
  mapping.start();
  const auto failed = call_save();
  EXPECT_FALSE(failed.success());
  EXPECT_THAT(failed.message(), HasSubstr("no_such_folder/map.mcap"));
}

TEST_F(LoadedMapTest, TheServiceSavesNoMapThatStaysAsItIs) {
  fake_.set_parameter("output_dir", folder_.string());
  fake_.set_parameter("localisation_only", true);
  MappingComponent mapping(fake_);
  mapping.start();
  EXPECT_FALSE(call_save().success());
  EXPECT_THAT(call_save().message(), HasSubstr("localisation_only"));
}

TEST_F(MappingTest, TheServiceNeedsAFolder) {
  MappingComponent mapping(fake_);
  send_keyframe(1, 0.0);
  send_pose(1, 1);
  EXPECT_FALSE(call_save().success());
  EXPECT_THAT(call_save().message(), HasSubstr("output_dir (--out) is not set"));
}

TEST_F(LoadedMapTest, IsRefusedWhenItIsBroken) {
  std::filesystem::resize_file(file(), 1000);
  MappingComponent mapping(fake_);
  try {
    mapping.start();
    FAIL() << "taken";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("map.mcap: the map cannot be loaded"));
  }
  EXPECT_TRUE(fake_.exit_requested());
  EXPECT_TRUE(mapping.mapper().map().keyframes().empty());
  EXPECT_TRUE(announced().empty());
}

}  // namespace
}  // namespace camvox
