#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "camvox/test/founded_map.hpp"
#include "camvox/test/tunnel_world.hpp"
#include "camvox/tracking/tracker.hpp"

namespace camvox::tracking {

using geometry::SE3;
using geometry::SO3;
using test::FoundedMap;
using test::TunnelWorld;

inline constexpr std::int64_t kFrame_ns = 100'000'000;

/// A tracker in a feature world, with a map that stays as founded.
class TrackerTest : public testing::Test {
 protected:
  void start(const TrackerConfig& config = {}) {
    tracker_.emplace(config, world_.camera(), TunnelWorld::T_body_camera());
    map_.emplace(world_.camera());
  }
  /// The next frame, seen from where the body is; the map follows at once.
  const FrameResult& step(const SE3& T_world_body,
                          const TunnelWorld::View& view = TunnelWorld::View(),
                          const std::optional<SO3>& R_previous_camera = std::nullopt) {
    ++frame_id_;
    auto frame = world_.see(T_world_body * TunnelWorld::T_body_camera(), frame_id_, now_ns_, view);
    frame.R_previous_camera = R_previous_camera;
    now_ns_ += kFrame_ns;
    result_ = tracker_->track(std::move(frame));
    keyframes_ += result_.keyframe ? 1 : 0;
    if (result_.keyframe) map_->insert(*result_.keyframe);
    tracker_->update_map(map_->local_map(frame_id_));
    return result_;
  }
  /// The next frame; no map comes.
  const FrameResult& step_without_mapping(const SE3& T_world_body) {
    ++frame_id_;
    result_ = tracker_->track(
        world_.see(T_world_body * TunnelWorld::T_body_camera(), frame_id_, now_ns_));
    now_ns_ += kFrame_ns;
    return result_;
  }
  /// The founded map after a loop was closed: everything moves and turns.
  [[nodiscard]] LocalMap corrected_map(const SE3& T_new_old) const {
    LocalMap map = map_->local_map(frame_id_ + 1);
    map.map_epoch = 1;
    for (auto& keyframe : map.keyframes) keyframe.T_map_camera = T_new_old * keyframe.T_map_camera;
    for (auto& landmark : map.landmarks) {
      landmark.p_map = T_new_old * landmark.p_map;
      landmark.f_map = (T_new_old.rotation() * landmark.f_map.cast<double>()).cast<float>();
    }
    return map;
  }
  const FrameResult& step_blind() {
    TunnelWorld::View view;
    view.max_features = 0;
    return step(SE3(), view);
  }
  [[nodiscard]] static SE3 at(double x_m, double yaw_rad = 0.0) {
    return {SO3::exp({0.0, 0.0, yaw_rad}), {x_m, 0.3 * std::sin(0.1 * x_m), 0.0}};
  }
  [[nodiscard]] double error_m(const SE3& T_world_body) const {
    const SE3 T_map_body = result_.T_map_camera * TunnelWorld::T_body_camera().inverse();
    return (T_map_body.translation() - T_world_body.translation()).norm();
  }

  TunnelWorld world_;
  std::optional<Tracker> tracker_;
  std::optional<FoundedMap> map_;
  FrameResult result_;
  std::uint64_t frame_id_ = 0;
  std::int64_t now_ns_ = 1'000'000'000;
  int keyframes_ = 0;
};

}  // namespace camvox::tracking
