#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>

#include "camvox/component/component.hpp"
#include "camvox/component/progress.hpp"
#include "camvox/interfaces/camvox_interfaces.hpp"
#include "camvox/interfaces/std_srvs.hpp"
#include "camvox/mapping/mapper.hpp"
#include "camvox/mapping_component/job_schedule.hpp"
#include "camvox/mapping_component/map_announcer.hpp"
#include "camvox/sensors/camera_intrinsics.hpp"
#include "camvox/tracking/frame_builder.hpp"

namespace camvox {

/// Parameters of MappingComponent.
struct MappingComponentConfig {
  bool lockstep = false;  ///< Bundle adjustment before the answer, so that runs repeat bit by bit.
  /// In lockstep: a frame that made a keyframe is answered after loop closing has answered too.
  bool wait_for_loop_closing = false;
  std::string output_dir;  ///< Folder to save the map in, as map.mcap; "" saves nothing.
  /// Save it at the end. Set to true while running, it saves at once as well.
  bool save_map = true;
  std::string load_map;            ///< Map file to start with; "" starts an empty map.
  bool localisation_only = false;  ///< The loaded map stays as it is.
  /// What a keyframe may take, with the landmarks that it founded; more is reported.
  int keyframe_budget_kb = 512;
  mapping::MappingConfig mapping;
  tracking::FrameBuilderConfig frame;  ///< As tracking's: the steps of the image pyramid.
  sensors::CameraIntrinsics camera;

  template <typename Self, typename Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("lockstep", self.lockstep);
    field("wait_for_loop_closing", self.wait_for_loop_closing);
    field("output_dir", self.output_dir);
    field("save_map", self.save_map);
    field("load_map", self.load_map);
    field("localisation_only", self.localisation_only);
    field("keyframe_budget_kb", self.keyframe_budget_kb, config::at_least(1));
    field("mapping", self.mapping);
    field("frame", self.frame);
    field("camera", self.camera);
  }
};

/// Owns the map (see mapping::Mapper). Answers the pose of every frame with the local map around
/// its reference keyframe, and tells what changed. Live, bundle adjustment runs on threads of its
/// own (see JobSchedule), and the map that it made is sent when it is there.
///
/// A loaded map is announced to loop closing first, so that tracking (which has the parameter
/// `load_map`, too) finds its place in it; keyframes that are not tied to it are refused, so that
/// there is never a second map beside it. A map that cannot be loaded ends the run.
///
/// Keyframes come in without a gap. When some were lost (the link was cut) or all (this process was
/// restarted), frames are answered with the map as it is; it says which keyframe is the next, and
/// tracking sends what is missing once more, in order. A restarted process, with a map loaded or
/// without, takes over the epoch that tracking has seen.
///
/// The service /camvox/save_map (std_srvs/srv/Trigger) saves the map as it is; it answers with the
/// file, or with what is wrong.
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
  void on_resent_keyframe(const Keyframe& message);
  void on_pose(const FramePose& pose);
  void take_over_epoch(const FramePose& pose);
  void on_correction(const LoopCorrection& correction);
  void answer_ready();
  void insert_up_to(const Waiting& frame);
  [[nodiscard]] bool is_ready(const Waiting& frame) const;
  void follow(const Waiting& frame);
  void answer(const Waiting& frame);
  void load();
  [[nodiscard]] std::string nothing_to_save() const;
  [[nodiscard]] std::string save();
  [[nodiscard]] bool save_changes();
  void on_save_request(std_srvs::srv::Trigger_Response& response);
  void announce();
  [[nodiscard]] std::string problem_with(const tracking::Keyframe& keyframe) const;
  void insert(const tracking::Keyframe& keyframe);
  void adjust(mapping::BundleJob job);
  [[nodiscard]] bool finish(const mapping::BundleJob& job,
                            const optimization::BundleSummary& summary,
                            double time_s);
  void publish_local_map(const Waiting& frame);
  void publish_update(Header header);
  void report();
  void report_memory();

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
  std::size_t frames_behind_ = 0;    ///< Answered without their keyframe since the last one came.
  std::size_t inserted_behind_ = 0;  ///< Keyframes that came late, since behind_.
  bool behind_ = false;              ///< Keyframes are missing.
  std::uint64_t refused_ = 0;
  mapping_component::MapAnnouncer announcer_;
  std::unique_ptr<mapping_component::JobSchedule> jobs_;  ///< Live only.
};

}  // namespace camvox
