#pragma once

#include <gmock/gmock.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "camvox/test/pipeline.hpp"

namespace camvox::test {

/// A frame as tracking saw it, against the truth.
struct JudgedFrame {
  double time_s = 0.0;
  std::uint8_t state = 0;
  double error_m = 0.0;    ///< Of the body's position, in the frame of the first.
  double error_deg = 0.0;  ///< Of its attitude.
  [[nodiscard]] bool tracked() const { return state == camvox_interfaces::msg::TRACKING_OK; }
};

/// What may happen to a message on its way: changed, or (false) lost.
using Mishap = std::function<bool(SensorMessage& message)>;

/// Runs a recording through the pipeline.
inline std::vector<JudgedFrame> run(Pipeline& pipeline,
                                    const Recording& recording,
                                    const Mishap& mishap = {}) {
  for (const auto& message : recording.messages()) {
    auto copy = message;
    if (!mishap || mishap(copy)) pipeline.send(copy);
  }
  std::vector<JudgedFrame> frames;
  std::optional<geometry::SE3> T_map_world;
  for (const auto& pose : pipeline.poses()) {
    const auto stamp_ns = pose.header().stamp_ns();
    JudgedFrame frame{recording.time_s(stamp_ns), pose.state()};
    if (frame.tracked()) {
      const auto T_world_body = recording.T_world_body(stamp_ns);
      const auto T_map_body =
          conversion::to_se3(pose.T_map_camera()) * recording.rig().T_body_camera.inverse();
      if (!T_map_world) T_map_world = T_map_body * T_world_body.inverse();
      const auto error = (*T_map_world * T_world_body).inverse() * T_map_body;
      frame.error_m = error.translation().norm();
      frame.error_deg = error.rotation().angle_rad() * 180.0 / M_PI;
    }
    frames.push_back(frame);
  }
  return frames;
}

inline bool is_image(const SensorMessage& message) { return message.message.index() == 0; }
inline bool is_lidar(const SensorMessage& message) { return message.message.index() == 1; }
inline bool is_imu(const SensorMessage& message) { return message.message.index() == 2; }

/// Share of frames in [from, to) that were tracked.
inline double tracked_share(const std::vector<JudgedFrame>& frames, double from_s, double to_s) {
  int all = 0, tracked = 0;
  for (const auto& frame : frames) {
    if (frame.time_s < from_s || frame.time_s >= to_s) continue;
    ++all;
    tracked += frame.tracked() ? 1 : 0;
  }
  return all == 0 ? -1.0 : static_cast<double>(tracked) / all;
}

inline double worst_m(const std::vector<JudgedFrame>& frames, double from_s = 0.0) {
  double worst = 0.0;
  for (const auto& frame : frames) {
    if (frame.tracked() && frame.time_s >= from_s) worst = std::max(worst, frame.error_m);
  }
  return worst;
}

}  // namespace camvox::test
