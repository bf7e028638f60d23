#include <gtest/gtest.h>

#include <cmath>

#include "../../src/mapping/mapping_world.hpp"
#include "camvox/component/fake_context.hpp"
#include "camvox/conversion/map_messages.hpp"
#include "camvox/conversion/pose.hpp"
#include "camvox/mapping_component/mapping_component.hpp"

namespace camvox {
namespace {

using camvox_interfaces::msg::FramePose;
using camvox_interfaces::msg::Keyframe;
using camvox_interfaces::msg::LoopCorrection;
using geometry::SE3;
using mapping::KeyframeId;
using mapping::MappingWorld;

constexpr int kKeyframes = 30;

/// A robot that drives along a street; bundle adjustment runs on threads, as on the robot.
class MappingLiveTest : public testing::Test {
 protected:
  MappingLiveTest() {
    const auto& camera = world_.camera();
    fake_.set_parameter("camera.width_px", std::int64_t{camera.width_px});
    fake_.set_parameter("camera.height_px", std::int64_t{camera.height_px});
    fake_.set_parameter("camera.fx_px", camera.pinhole.fx_px);
    fake_.set_parameter("camera.fy_px", camera.pinhole.fy_px);
    fake_.set_parameter("camera.cx_px", camera.pinhole.cx_px);
    fake_.set_parameter("camera.cy_px", camera.pinhole.cy_px);
    mapping_ = std::make_unique<MappingComponent>(fake_);
    mapping_->start();
  }
  ~MappingLiveTest() override { mapping_->stop(); }

  [[nodiscard]] const mapping::Map& map() const { return mapping_->mapper().map(); }
  void drive_to(double z_m) {
    auto keyframe = world_.look(MappingWorld::on_street(z_m), mapping_->mapper());
    // Tracking knows where it is in the map as that is, bent or not.
    if (keyframe.parent_id != 0) {
      keyframe.T_parent_camera =
          world_.T_map_camera()[keyframe.parent_id - 1].inverse() * MappingWorld::on_street(z_m);
    }
    fake_.send<Keyframe>("keyframe", [&](Keyframe& message) {
      ASSERT_TRUE(conversion::write_keyframe(keyframe, message));
    });
    FramePose pose;
    pose.header().frame_id(keyframe.frame_id);
    pose.reference_keyframe_id(keyframe.id);
    fake_.send("frame_pose", pose);
  }
  void drive() {
    for (int i = 0; i < kKeyframes; ++i) {
      drive_to(i);
      fake_.run_posted(std::chrono::seconds(5));
    }
  }
  /// False when no job is left, and none was a full adjustment that converged.
  [[nodiscard]] bool full_adjustment_converges() {
    while (fake_.run_posted(std::chrono::seconds(10)) > 0) {
      if (diagnostics("full bundle adjustment").find("converged") != std::string::npos) return true;
    }
    return false;
  }
  /// A loop that bends the map, as a pose graph does: by `offset_m` at its end.
  void send_correction(double offset_m) {
    fake_.send<LoopCorrection>("loop_correction", [&](LoopCorrection& correction) {
      const KeyframeId last = map().keyframes().rbegin()->first;
      correction.header().frame_id(10 * last);
      correction.map_epoch(mapping_->mapper().epoch());
      correction.query_keyframe_id(last);
      correction.match_keyframe_id(1);
      std::uint32_t count = 0;
      for (const auto& [id, keyframe] : map().keyframes()) {
        const double part = static_cast<double>(id) / static_cast<double>(last);
        const SE3 bent = SE3({}, {offset_m * part * part, 0, 0}) * keyframe.frame.T_map_camera;
        correction.keyframe_ids()[count] = id;
        correction.keyframe_poses()[count++] = conversion::to_array(bent);
      }
      correction.keyframe_ids_count(count);
      correction.keyframe_poses_count(count);
    });
  }
  [[nodiscard]] std::string diagnostics(const std::string& key) {
    const auto values = fake_.diagnostics().status().values;
    const auto found = values.find(key);
    return found == values.end() ? "" : found->second;
  }

  MappingWorld world_{{.points = 3000, .pose_noise = 0.0, .length_m = 70.0}};
  FakeContext fake_;
  std::unique_ptr<MappingComponent> mapping_;
};

// Landmarks along the street tie its keyframes: the full adjustment straightens it again, if it is
// let.
TEST_F(MappingLiveTest, KeyframesDoNotEndTheFullAdjustmentAfterALoop) {
  drive();
  send_correction(0.4);
  EXPECT_GT(worst_position_m(mapping_->mapper(), world_), 0.3);
  drive_to(kKeyframes);
  drive_to(kKeyframes + 1);
  ASSERT_TRUE(full_adjustment_converges()) << diagnostics("full bundle adjustment");
  // A tenth of the bend; half a pixel of noise alone makes millimetres.
  EXPECT_LT(worst_position_m(mapping_->mapper(), world_), 0.04);
  map().check_consistency();
}

TEST_F(MappingLiveTest, AnotherLoopStartsTheFullAdjustmentAnew) {
  drive();
  send_correction(0.2);
  send_correction(0.2);
  EXPECT_EQ(mapping_->mapper().epoch(), 2U);
  drive_to(kKeyframes);
  ASSERT_TRUE(full_adjustment_converges()) << diagnostics("full bundle adjustment");
  EXPECT_LT(worst_position_m(mapping_->mapper(), world_), 0.04);
}

}  // namespace
}  // namespace camvox
