#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <set>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/loop/loop_closer.hpp"
#include "camvox/loop_closing/map_order.hpp"
#include "camvox/loop_closing/worker.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"

namespace camvox {

/// Parameters of LoopClosingComponent. YAML keys are the field names.
struct LoopClosingComponentConfig {
  bool enabled = true;    ///< False: no loops, only answers to a lost tracker.
  bool lockstep = false;  ///< All on the component's thread, in the map's order.
  int max_waiting = 4;    ///< Live: keyframes that wait for the worker; further ones are left out.
  loop::LoopCloserConfig loop;
  sensors::CameraIntrinsics camera;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("enabled", self.enabled);
    field("lockstep", self.lockstep);
    field("max_waiting", self.max_waiting, config::at_least(1), config::at_most(1000));
    field("loop", self.loop);
    field("camera", self.camera);
  }
};

/// Answers every keyframe with a loop correction (without poses: no loop), and a lost tracker with
/// where it is. Finding candidates is done at once; verifying them and solving the pose graph is
/// the worker's, except in lockstep. A correction whose poses belong to an epoch that has passed is
/// not sent; the loop itself is kept, and the next keyframe brings it up again.
class LoopClosingComponent final : public Component {
 public:
  explicit LoopClosingComponent(Context& context);

  void start() override;
  void stop() override { worker_.reset(); }

 private:
  using Header = camvox_interfaces::msg::MessageHeader;
  using Keyframe = camvox_interfaces::msg::Keyframe;
  using LoopCorrection = camvox_interfaces::msg::LoopCorrection;
  using MapUpdate = camvox_interfaces::msg::MapUpdate;
  using RelocalisationAnswer = camvox_interfaces::msg::RelocalisationAnswer;
  /// Work for any thread; returns what is then to be done on the component's.
  using HeavyWork = std::function<std::function<void()>()>;

  void on_keyframe(const Keyframe& message);
  void on_map_keyframe(const Keyframe& message);
  void on_map_update(const MapUpdate& message);
  void on_request(const Keyframe& message);
  void advance();
  void look_for_loops(const Header& header, tracking::KeyframeId id);
  void verified(const Header& header,
                tracking::KeyframeId id,
                const std::vector<loop::VerifiedPlace>& places);
  void corrected(const Header& header, const loop::Correction& correction);
  void answer_keyframe(const Header& header, const loop::Correction* correction);
  void answer_request(const Header& header, const std::vector<loop::VerifiedPlace>& places);
  void run(const HeavyWork& work);
  void report();

  Context& context_;
  LoopClosingComponentConfig config_;
  optimization::PinholeCamera camera_;
  loop::LoopCloser closer_;
  loop_closing::MapOrder order_;
  ProgressReporter progress_;
  Publisher<LoopCorrection> corrections_;
  Publisher<RelocalisationAnswer> answers_;
  std::unique_ptr<loop_closing::Worker> worker_;
  std::set<tracking::KeyframeId> resent_;  ///< Sent again, and not yet looked at.
  std::uint64_t left_out_ = 0;             ///< Keyframes that the worker had no time for.
  std::uint64_t outdated_ = 0;             ///< Corrections that the map had moved on from.
  std::uint64_t requests_ = 0;
  std::uint64_t relocalised_ = 0;
};

}  // namespace camvox
