#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/mapping/mapper.hpp"
#include "camvox/mapping_component/job_runner.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/tracking/frame_builder.hpp"

namespace camvox {

/// Parameters of MappingComponent.
struct MappingComponentConfig {
  bool lockstep = false;  ///< Bundle adjustment before the answer, so that runs repeat bit by bit.
  /// In lockstep: a frame that made a keyframe is answered after loop closing has answered too.
  bool wait_for_loop_closing = false;
  mapping::MappingConfig mapping;
  tracking::FrameBuilderConfig frame;  ///< As tracking's: the steps of the image pyramid.
  sensors::CameraIntrinsics camera;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("lockstep", self.lockstep);
    field("wait_for_loop_closing", self.wait_for_loop_closing);
    field("mapping", self.mapping);
    field("frame", self.frame);
    field("camera", self.camera);
  }
};

/// Owns the map (see mapping::Mapper). Answers the pose of every frame with the local map around
/// its reference keyframe, and tells what changed. Live, bundle adjustment runs on a thread of its
/// own: a new keyframe interrupts it, and the map that it made is sent when it is there.
class MappingComponent final : public Component {
 public:
  explicit MappingComponent(Context& context);
  void start() override;
  void stop() override;

  [[nodiscard]] const mapping::Mapper& mapper() const { return mapper_; }

 private:
  using FramePose = camvox_interfaces::msg::FramePose;
  using Keyframe = camvox_interfaces::msg::Keyframe;
  using LoopCorrection = camvox_interfaces::msg::LoopCorrection;
  using Header = camvox_interfaces::msg::MessageHeader;

  /// A frame that waits for its answer.
  struct Waiting {
    Header header;
    std::uint64_t reference_id = 0;
  };

  void on_keyframe(const Keyframe& message);
  void on_pose(const FramePose& pose);
  void on_correction(const LoopCorrection& correction);
  void answer_ready();
  [[nodiscard]] bool is_ready(const Waiting& frame) const;
  void answer(const Waiting& frame);
  void insert(const tracking::Keyframe& keyframe);
  void adjust(mapping::BundleJob job);
  void finish(const mapping::BundleJob& job,
              const optimization::BundleSummary& summary,
              double time_s);
  void start_next_job();
  void publish_local_map(const Waiting& frame);
  void publish_update(const Header& header);
  void report();

  Context& context_;
  MappingComponentConfig config_;
  mapping::Mapper mapper_;
  ProgressReporter progress_;
  Publisher<camvox_interfaces::msg::LocalMap> local_maps_;
  Publisher<camvox_interfaces::msg::MapUpdate> updates_;
  std::map<std::uint64_t, tracking::Keyframe> keyframes_;  ///< By id: not yet inserted.
  std::deque<Waiting> waiting_;
  std::set<std::uint64_t>
      loop_answers_;  ///< Frames that loop closing has answered, the newest few.
  Waiting last_;      ///< The frame answered last.
  std::uint64_t newest_keyframe_ = 0;
  std::uint64_t newest_keyframe_frame_ = 0;
  std::uint64_t job_due_ = 0;  ///< Keyframe whose surroundings are to be adjusted; 0: none.
  bool full_due_ = false;      ///< The whole map is to be adjusted.
  std::uint64_t refused_ = 0;
  std::unique_ptr<mapping_component::JobRunner> runner_;
};

}  // namespace camvox
